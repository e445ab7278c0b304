"""What a study leaves: tables, what their columns mean, and the manifest. Data only."""
