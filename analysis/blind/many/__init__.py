"""The study of robots that hold several effects at once."""
