"""PID with a clamped integral, the derivative on the measurement, and a limited output (paper, eq. 10)."""

from __future__ import annotations

from flightd.config.control import PidGains


class Pid:
    """One loop: kp per unit of error, ki per unit second, kd per unit of the measured rate; the integral's
    share of the output is bounded, and the output as a whole.  The derivative acts on the measured rate, so
    a jump of the setpoint does not kick."""

    def __init__(self, gains: PidGains, integral_limit: float, output_limit: float) -> None:
        self._gains = gains
        self._integral_limit = integral_limit
        self._output_limit = output_limit
        self._integral = 0.0

    @property
    def integral(self) -> float:
        """The integral's present share of the output."""
        return self._integral

    def reset(self, integral: float = 0.0) -> None:
        limit = self._integral_limit
        self._integral = min(max(integral, -limit), limit)

    def step(
        self, error: float, rate: float, dt_s: float, feed_forward: float = 0.0, ease: float = 1.0
    ) -> float:
        """Output for this `error` (setpoint minus measurement) and measured `rate`; the loop answers `ease`
        times as fast as configured, with the same damping.

        The integral stands still while the output is at its limit and the error would drive it further
        (conditional integration), and never exceeds its own limit.
        """
        g = self._gains
        direct = ease**2 * g.kp * error - ease * g.kd * rate + feed_forward
        candidate = self._integral + ease**3 * g.ki * error * dt_s
        candidate = min(max(candidate, -self._integral_limit), self._integral_limit)
        output = direct + candidate
        if abs(output) <= self._output_limit or output * error < 0:
            self._integral = candidate
        output = direct + self._integral
        return min(max(output, -self._output_limit), self._output_limit)
