"""Reports of sessions: figures, comparison, HTML."""
