"""Events and alarms: decisions of people in control rooms, and the messages they become."""
