"""What a session says to a test engineer: its figures with their uncertainty, a page to print, two sessions side by side."""
