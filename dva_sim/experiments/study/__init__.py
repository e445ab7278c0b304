"""What a study asks: its file, its design, its registration, and the cells they come to."""
