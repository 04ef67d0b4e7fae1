"""A page on this machine that shows the axis while it moves; never in the way of the loop that moves it."""
