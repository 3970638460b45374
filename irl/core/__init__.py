"""The vocabulary every layer shares; it imports nothing else of irl."""
