// A world that another process serves as a robot of YARP, and YARP's own clients of it.
#pragma once

#include "../../test/served.hpp"
#include "running.hpp"
#include "stand.hpp"
#include "units.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <yarp/dev/ControlBoardInterfaces.h>
#include <yarp/dev/PolyDriver.h>
#include <yarp/os/Bottle.h>
#include <yarp/os/Log.h>
#include <yarp/os/Network.h>
#include <yarp/os/Property.h>
#include <yarp/os/RpcClient.h>

namespace bf::yarp::test {

namespace os = ::yarp::os;
namespace dev = ::yarp::dev;
using middleware::test::diagram;
using middleware::test::icub;
using middleware::test::icub_world;
using toolbox::test::expect_contains;
using toolbox::test::refusal;
using toolbox::test::Running;

template <class F> bool waits_until(F&& is_so) {
    for (int k = 0; k < 20'000; ++k, usleep(1000))
        if (is_so()) return true;
    return false;
}

/// A robot with that board of the served world, which leads its clock.
inline std::string led_robot(const std::string& board) {
    return "  world: {block: Yarp/Robot, period: 0.001, timeout: 5, start_timeout: 60, boards: \"{'" + board +
           "'}\", simulator: /clock/rpc}\n";
}

/// A device of YARP, as its clients open it.
class Client {
  public:
    Client(const std::string& device, const std::string& remote, const std::string& local) {
        os::Property wanted;
        wanted.put("device", device);
        wanted.put("remote", remote);
        wanted.put("local", local);
        if (!driver_.open(wanted)) throw std::runtime_error("YARP's client does not open");
    }
    template <class I> I& as() {
        I* view = nullptr;
        if (!driver_.view(view)) throw std::runtime_error("YARP's client has no such view");
        return *view;
    }

  private:
    dev::PolyDriver driver_;
};

class YarpServe : public YarpNetwork {
  protected:
    void SetUp() override {
        YarpNetwork::SetUp();
        if (IsSkipped()) return;
        server_ = std::make_unique<Program>(name_server());
        ASSERT_TRUE(is_there("/root"));
        model_ = write("icub.yaml", diagram(icub + icub_world));
        os::Log::setMinimumPrintLevel(os::Log::FatalType);
        static const os::Network network;
        os::NetworkBase::setLocalMode(false);
    }
    Program serve(const std::vector<std::string>& more = {}) const { return serve(model_, more); }
    Program serve(const std::string& model, const std::vector<std::string>& more) const {
        std::vector<std::string> words{BF_PROGRAM, "serve", model, "--yarp", "icubSim"};
        words.insert(words.end(), more.begin(), more.end());
        return Program(words, folder_ / "said");
    }
    /// The clock by which the world goes on.
    struct Clock {
        Clock() {
            port.open("/test/clock/rpc:o");
            if (!os::NetworkBase::connect("/test/clock/rpc:o", "/clock/rpc"))
                throw std::runtime_error("no /clock/rpc");
        }
        double ask(const std::string& what) {
            os::Bottle question, answer;
            question.fromString(what);
            if (!port.write(question, answer)) throw std::runtime_error(what + " is not answered");
            return answer.get(0).asFloat64();
        }
        os::RpcClient port;
    };
    /// The newest positions of that time, rad.
    static Eigen::Vector3d positions(Client& board, double time) {
        double values[3] = {}, stamps[3] = {};
        EXPECT_TRUE(waits_until([&] {
            return board.as<dev::IEncodersTimed>().getEncodersTimed(values, stamps) &&
                   std::abs(stamps[0] - time) < 1e-6;
        })) << stamps[0];
        return Eigen::Vector3d(values[0], values[1], values[2]) / degrees;
    }
    static bool are_in(Client& board, int mode) {
        int modes[3] = {};
        return board.as<dev::IControlMode>().getControlModes(modes) &&
               std::ranges::all_of(modes, [&](int its) { return its == mode; });
    }
    static void set_modes(Client& board, int mode) {
        int modes[3] = {mode, mode, mode};
        ASSERT_TRUE(board.as<dev::IControlMode>().setControlModes(modes));
        ASSERT_TRUE(waits_until([&] { return are_in(board, mode); }));
    }
    std::string model_;

  private:
    std::unique_ptr<Program> server_;
};

} // namespace bf::yarp::test
