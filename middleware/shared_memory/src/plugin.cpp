// The plugin SharedMemory.
#include "bf/core/registry.hpp"
#include "bf/shared_memory/robot.hpp"

namespace bf::shared_memory {

namespace {

class Robot final : public middleware::RemoteRobot {
  public:
    explicit Robot(const Arguments& arguments) : RemoteRobot(arguments) {
        if (auto wrong = wrong_name(name); !wrong.empty()) problem(std::move(wrong));
    }
    Argument<std::string> name{this, "name", {.initial = "robot", .doc = "under which it is served"}};

  private:
    std::unique_ptr<middleware::RobotLink> make_link() const override {
        return shared_memory::make_link(name);
    }
};

} // namespace

} // namespace bf::shared_memory

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("robot").add<bf::shared_memory::Robot>(
        "Robot",
        "A robot that another program of this user on this computer serves through shared memory, such as "
        "`bf serve MODEL --shm NAME`: the robot that GetMeasurement, GetSensor, GetLimits, SetReferences, "
        "SetLowLevelPID and SetMotorParameters in its subsystem and below use. Each of its periods takes the "
        "newest state and sends what was commanded. A robot that waits for its controller goes on by one "
        "period with each step, so that all runs are the same, bit for bit. When this program stops, is "
        "killed or falls silent, the server takes the joints back. The run's report has the largest age and "
        "the final drift. Errors: no such robot within start_timeout, another controller, other joints, "
        "another version; in a step: a server that has ended, no new state within the timeout, joints that "
        "were taken back, commands that the robot refuses.");
}
