"""What residuals mean: whether they are what noise and model error explain, and if not, which fault explains them."""
