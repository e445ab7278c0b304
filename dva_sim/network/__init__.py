"""How bytes travel: links, reliable streams on them, and the messaging patterns on top."""
