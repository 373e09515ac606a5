"""From strokes to a prediction: smoother, look-ahead, sensor model."""
