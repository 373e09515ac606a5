"""Tables of other programs (loggers, spreadsheets, data frames) as sessions."""
