"""The library of effects: every physical cause of torque that the paper's model lacks."""
