"""Actions of pages, done once and answered once, or refused with the reason."""
