"""Study of round-off: digits lost by two ways of combining elements, and the error of the tip over ever smaller steps."""
