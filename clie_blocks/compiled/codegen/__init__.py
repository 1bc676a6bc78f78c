"""From a graph of symbols to a program: LLVM, Python or C."""
