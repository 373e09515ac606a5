"""Import of logger files, spreadsheets and data frames as sessions."""
