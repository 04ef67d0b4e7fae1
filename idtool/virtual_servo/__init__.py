"""A virtual servo: a pseudo-terminal that speaks DYNAMIXEL Protocol 2.0 in front of a simulated axis.

Written from the protocol's description and apart from the vendor's SDK, so that the SDK is an
independent check of it. It exists to rehearse a session, and its mishaps, without a device.
"""
