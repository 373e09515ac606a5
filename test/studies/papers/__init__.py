"""Study of the method's two papers: their equations, figures and claims, computed by this model."""
