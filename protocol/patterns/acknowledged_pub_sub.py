"""An example of an own pattern: copy this file, change it, and name it in a scenario.

    pattern: acknowledged_pub_sub.py:AcknowledgedPubSub

`dva-sim check pattern acknowledged_pub_sub.py:AcknowledgedPubSub` tells whether it keeps what
every pattern promises.
"""

from dva_sim.kernel.errors import ConfigError
from dva_sim.network.patterns import Pattern


class AcknowledgedPubSub(Pattern):
    """Publish and subscribe, but every n-th command is a request that the robot answers.

    Nothing waits for the answer: while it is out, commands go on being published. But the app
    learns that nobody is there after `every` commands and the time-outs of all attempts, and that
    it is refused as soon as the first answer says so.

    Args:
        every: Interval of requests, in commands; 1 sends one whenever the last reply has arrived.
        timeout_s: Time to wait for a reply [s]; `command.timeout_s` by default.
    """

    title, label = "acknowledged PUB/SUB", "acknowledged"
    sockets, when_slow = "XPUB to SUB, and REQ to ROUTER", "commands are skipped"
    answered = published = newest_wins = True

    def __init__(self, every=10, timeout_s=None):
        if isinstance(every, bool) or not isinstance(every, int) or every < 1:
            raise ConfigError(f"option 'every' is {every!r}; should be a whole number from 1")
        if timeout_s is not None and not timeout_s > 0:
            raise ConfigError(f"option 'timeout_s' is {timeout_s!r}; should be above 0")
        self.every, self.timeout = every, timeout_s
        self.since = 0  # commands since the last request

    def begin(self, line):
        """A drive begins: a socket for the requests, one at a time."""
        super().begin(line)
        line.open_requests(timeout=self.timeout)

    def offer(self, command):
        """Publish, or ask if it is time and the last answer is there."""
        self.since += 1
        if self.since < self.every or self.line.busy:
            self.line.publish(command)
            return
        self.since = 0
        self.line.request(command, lambda reply: None, self.line.lost)  # the app reads the reply
