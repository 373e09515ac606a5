"""Studies of methods and models, written as tables and pictures (`boom_twin study`)."""
