// The balancing law of examples/icub_balancing as one would write it without a block diagram.
#pragma once

#include "icub_law.hpp"

#include <Eigen/Core>

/// Takes, gives and is tuned by what the generated class is, so that both can be compared.
class HandLaw {
  public:
    explicit HandLaw(const IcubLaw::Parameters& parameters) : p_(parameters) {}
    void step(const IcubLaw::Inputs& in, IcubLaw::Outputs& out);

  private:
    int next_state(double com_y, double force_right);

    const IcubLaw::Parameters& p_;
    double time_ = 0, entered_ = 0; ///< s
    int steps_ = 0, state_ = 1;
    Eigen::Vector3d com_start_;
};
