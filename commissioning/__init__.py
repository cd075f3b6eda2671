"""First contact with a real line: which of our assumptions hold there, and which settings follow."""
