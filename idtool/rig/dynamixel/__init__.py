"""A DYNAMIXEL servo of the X series on a serial bus, through the manufacturer's SDK."""
