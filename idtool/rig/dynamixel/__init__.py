"""A DYNAMIXEL servo on a serial bus, through the manufacturer's SDK."""
