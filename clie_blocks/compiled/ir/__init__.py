"""The intermediate representation: symbols, operations, and where a program keeps its values."""
