"""Events and alarms: what people in control rooms decide, and the messages that it becomes."""
