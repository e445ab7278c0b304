"""Dispatch against exact answers: worlds that theory knows, played again and compared."""
