// The plugin Yarp.
#include "bf/core/registry.hpp"
#include "board.hpp"
#include "network.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace bf::yarp {

namespace {

class Robot final : public middleware::RemoteRobot {
  public:
    explicit Robot(const Arguments& arguments) : RemoteRobot(arguments) {
        if (boards->empty())
            problem("argument 'boards' is empty; name the robot's control boards, such as left_leg");
        if (!is_name(robot))
            problem("argument 'robot' is '" + *robot + "'; " + how_to_name + ", such as icubSim");
        for (const auto& board : *boards)
            if (!is_name(board))
                problem("argument 'boards' has '" + board + "'; " + how_to_name + ", such as left_leg");
        require_names_of(wrenches, "/port");
        require_names_of(imus, "/port");
    }
    Argument<std::string> robot{this, "robot", {.initial = "icubSim", .doc = "prefix of the robot's ports"}};
    Argument<std::vector<std::string>> boards{
        this,
        "boards",
        {.doc = "control boards that have the joints, such as left_leg of /icubSim/left_leg"}};
    Argument<std::string> local{
        this, "local", {.doc = "prefix of this program's ports; none: one of this run alone"}};
    Argument<std::vector<std::string>> wrenches{
        this, "wrenches", {.doc = "force/torque sensors, each as name=/port that streams 6 numbers"}};
    Argument<std::vector<std::string>> imus{
        this,
        "imus",
        {.doc = "inertial sensors, each as name=/port that streams 12 numbers: roll pitch yaw [deg], "
                "acceleration, angular velocity [deg/s], magnetic field"}};
    Argument<std::string> simulator{
        this,
        "simulator",
        {.doc = "port by which a simulated robot goes on, such as /clock/rpc: with each step by one period, "
                "after what was commanded has come; none: the robot has a clock of its own"}};
    Argument<std::string> carrier{
        this,
        "carrier",
        {.initial = "udp",
         .doc = "by which YARP brings states and commands: udp, where the newest does not wait for what is "
                "lost; tcp and fast_tcp, where it does",
         .choices = {"udp", "tcp", "fast_tcp"}}};
    middleware::ThreadArguments thread{this};

  private:
    std::unique_ptr<middleware::RobotLink> make_link() const override {
        return middleware::make_threaded_link("YARP robot '" + *robot + "'",
                                              make_driver({robot, boards, joint_names(), local, wrenches,
                                                           imus, simulator, carrier, start_timeout}),
                                              thread);
    }
    static constexpr char how_to_name[] = "write what its ports are called, without / at both ends, of "
                                          "letters, digits and _-./";
    static bool is_name(const std::string& text) {
        return !text.empty() && text.front() != '/' && text.back() != '/' && text.find("//") == text.npos &&
               std::ranges::all_of(text, [](unsigned char c) {
                   return std::isalnum(c) ||
                          std::string_view("_-./").find(static_cast<char>(c)) != std::string_view::npos;
               });
    }
};

class NetworkBlock final : public Block {
  public:
    using Block::Block;
    Provides<toolbox::StreamNetwork> network{
        this, []() -> std::shared_ptr<const toolbox::StreamNetwork> { return std::make_shared<Network>(); }};

    void start(Now) const override { join(); }
};

} // namespace

} // namespace bf::yarp

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("robot").add<bf::yarp::Robot>(
        "Robot",
        "A robot behind YARP's control boards (remotecontrolboardremapper), in place of a world: the robot "
        "that GetMeasurement, GetSensor, GetLimits, SetReferences, SetLowLevelPID and SetMotorParameters in "
        "its subsystem and below use. YARP's calls take locks and wait for the network, so a thread of its "
        "own makes them: it looks at the robot every `interval` s, gives it what was commanded, and takes "
        "the joints back (mode Position) when the run ends or has not stepped for `silence` s. With "
        "`simulator` the thread steps the robot instead, in lockstep with the diagram. Of states that "
        "overtake each other the newest counts, for each joint; one that is older by more than 0.2 s, after "
        "0.2 s without any, is of a clock that has begun again. Ages are counted from when a state came. "
        "Angles are radians here and degrees there; prismatic joints and their motors are in m at both ends. "
        "Errors: no name server, boards, joints or sensors of these names; another diagram that drives one "
        "of the joints; in a step: those of SharedMemory/Robot.");
    library.group("streams").add<bf::yarp::NetworkBlock>(
        "Network",
        "The YARP network, for the blocks StreamRead (YarpRead), StreamWrite (YarpWrite), NetworkClock "
        "(YarpClock), SimulatorSynchronizer, SimulatorClock and RealTimeSynchronizer in its subsystem and "
        "below. Streams are ports of vectors: a name that a port has already is connected to, from a port "
        "without a name; otherwise it is the name of the port that is opened. Messages come and go in "
        "threads of their own, and the newest counts; the timestamp is the message's envelope, or where it "
        "has none its number and when it came. Simulators are stepped by the service ClockServer of Gazebo's "
        "plugins for YARP (/clock/rpc), and a model with SimulatorClock serves it. The time is that of YARP, "
        "which YARP_CLOCK leads. It has no ports. Errors: no name server; a name that another program has.");
}
