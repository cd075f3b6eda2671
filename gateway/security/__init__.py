"""The security log: who was let in, who was refused, and who changed who may do what."""
