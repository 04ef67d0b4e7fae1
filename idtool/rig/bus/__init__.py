"""What every servo on a serial bus has in common: port, transactions, the rig, its settings, the scan."""
