"""People on foot: guards who deal with events, bystanders who leave, and how both walk."""
