"""A virtual servo of Feetech's STS series, written from its published protocol and memory table and apart
from the vendor's SDK, so that the SDK is an independent check of it.
"""
