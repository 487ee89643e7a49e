#pragma once

namespace bf::trajectory {

/// A quantity with its rates at one instant.
struct Motion {
    double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

/// The motion of least ∫ jerk² from a state to rest at a target in the time T, a polynomial of fifth order.
/// Source: T. Flash, N. Hogan, The coordination of arm movements: an experimentally confirmed mathematical
/// model, 1985.
struct Quintic {
    Quintic() = default;
    /// T > 0, or 0: it is at the target at once.
    Quintic(const Motion& start, double target, double T) noexcept;

    /// After the time t from the start, which may be longer than T.
    Motion at(double t) const noexcept;

    /// Largest magnitudes between start and end.
    struct Peaks {
        double velocity, acceleration, jerk;
    };
    Peaks peaks() const noexcept;

    double target = 0.0, duration = 0.0;
    double c[6] = {}; ///< of (t/T)ᵏ
};

} // namespace bf::trajectory
