"""The report of a study: its page, its tables, its figures, on screen and on paper."""
