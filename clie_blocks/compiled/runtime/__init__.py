"""Running a compiled program: inputs, methods, events, batches, sensitivities."""
