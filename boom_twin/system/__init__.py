"""Files, folders, child processes and terminal text, whatever they hold."""
