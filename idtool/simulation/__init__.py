"""The motion that a parameter file makes of logs, and the search for the file whose motion they show."""
