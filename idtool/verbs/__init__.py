"""What a person asks of logs: identify, predict, check."""
