"""Reference model of a boom part with clearance in one rod pin, integrated by SciPy between contacts."""
