"""A Feetech servo of the STS or SMS series on a serial bus, through the manufacturer's SDK."""
