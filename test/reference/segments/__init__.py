"""Reference model of short rigid segments with springs between them."""
