"""From strokes to a prediction: stroke filter, look-ahead, sensor model."""
