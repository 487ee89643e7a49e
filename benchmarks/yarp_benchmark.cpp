// What the thread of a YARP robot does for each state, beside YARP's bare calls.
#include "board.hpp"
#include "own_process.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <benchmark/benchmark.h>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/os/Log.h>
#include <yarp/os/Network.h>
#include <yarp/os/Property.h>

#include "bf/middleware/clock.hpp"

namespace {

using bf::middleware::Measurement;
using bf::middleware::measurement_count;
using bf::middleware::now;
namespace dev = yarp::dev;

constexpr int n = 23;

/// s.
struct Measured {
    std::array<double, 201> board, bare;
    bool is_good;
};

template <class F> void time(std::array<double, 201>& times, F&& f) {
    for (double& each : times) {
        const double begin = now();
        f();
        each = now() - begin;
    }
}

void open(dev::PolyDriver& driver, const std::string& config) {
    yarp::os::Property wanted;
    wanted.fromConfig(config.c_str());
    if (!driver.open(wanted)) throw std::runtime_error("YARP's device does not open");
}

void measure(Measured& measured) {
    setenv("YARP_DATA_DIRS", BF_YARP_DATA, 1);
    yarp::os::Log::setMinimumPrintLevel(yarp::os::Log::FatalType);
    yarp::os::Log::setPrintCallback([](auto...) {});
    yarp::os::Network network;
    yarp::os::NetworkBase::setLocalMode(true);
    std::string names;
    std::vector<std::string> joints;
    for (int i = 0; i < n; ++i) {
        joints.push_back("joint" + std::to_string(i));
        names += " " + joints.back();
    }
    dev::PolyDriver pretended, client;
    open(pretended,
         "device controlboardwrapper2\nsubdevice fakeMotionControl\nname /icubSim/all\nperiod 10\n[GENERAL]\n"
         "Joints " +
             std::to_string(n) + "\nAxisName" + names + "\n");
    const auto driver = bf::yarp::make_driver({"icubSim", {"all"}, joints, "/board", {}, {}});
    driver.robot->start();
    open(client, "device remote_controlboard\nremote /icubSim/all\nlocal /bare\n");
    dev::IEncoders* encoders = nullptr;
    dev::IMotorEncoders* motors = nullptr;
    dev::ITorqueControl* torques = nullptr;
    dev::ICurrentControl* currents = nullptr;
    dev::IPWMControl* pwm = nullptr;
    client.view(encoders);
    client.view(motors);
    client.view(torques);
    client.view(currents);
    client.view(pwm);
    Eigen::VectorXd values(n);
    while (!encoders->getEncoders(values.data())) usleep(1000);
    time(measured.board, [&] {
        for (int i = 0; i < measurement_count; ++i) driver.robot->read(static_cast<Measurement>(i), values);
    });
    time(measured.bare, [&] {
        double* to = values.data();
        encoders->getEncoders(to);
        encoders->getEncoderSpeeds(to);
        encoders->getEncoderAccelerations(to);
        torques->getTorques(to);
        motors->getMotorEncoders(to);
        motors->getMotorEncoderSpeeds(to);
        motors->getMotorEncoderAccelerations(to);
        currents->getCurrents(to);
        pwm->getDutyCycles(to);
    });
    measured.is_good = true;
    _exit(0); // devices of that kind do not bear to be closed
}

/// The medians.
void yarp_read(benchmark::State& state, std::array<double, 201> Measured::*what) {
    for (auto _ : state) {
        const auto measured = bf::benchmarks::measured_alone(measure);
        if (!measured) {
            state.SkipWithError("YARP's devices do not open");
            return;
        }
        auto times = (*measured).*what;
        std::nth_element(times.begin(), times.begin() + 100, times.end());
        state.SetIterationTime(times[100]);
    }
}
BENCHMARK_CAPTURE(yarp_read, board, &Measured::board)
    ->Name("middleware.yarp_read/board")
    ->UseManualTime()
    ->Iterations(3)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(yarp_read, bare, &Measured::bare)
    ->Name("middleware.yarp_read/bare")
    ->UseManualTime()
    ->Iterations(3)
    ->Unit(benchmark::kMicrosecond);

} // namespace
