"""What makes policies: ``search`` over the figures of a gait, ``deep`` reinforcement learning."""
