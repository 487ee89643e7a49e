// Who is connected to control boards, and which joints the diagrams among them drive.
#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>
#include <yarp/os/Bottle.h>
#include <yarp/os/Port.h>
#include <yarp/os/PortReader.h>

namespace bf::yarp {

/// The clients of a control board, as its port tells them over a connection that stays.
class Clients {
  public:
    /// Of the board whose ports begin with `board`, such as /icubSim/left_leg.
    explicit Clients(std::string board) : board_(std::move(board)) {}

    /// The ports by which clients of YARP's device remote_controlboard ask the board; none: it does not
    /// answer. Those who ask without this device, such as the command `yarp rpc`, are left out.
    std::optional<std::vector<std::string>> ask();
    const std::string& board() const { return board_; }

  private:
    const std::string board_;
    ::yarp::os::Port port_;
};

/// Tells others which joints a diagram drives, at the port PREFIX/driver.
class Driver final : ::yarp::os::PortReader {
  public:
    explicit Driver(const std::vector<std::string>& joints);
    ~Driver() override;
    /// `prefix` is that of the diagram's ports; one of before is closed. False: the port does not open.
    bool open(const std::string& prefix);

  private:
    bool read(::yarp::os::ConnectionReader& reader) override;
    ::yarp::os::Bottle joints_;
    ::yarp::os::Port port_;
};

/// What the diagram with this client of a board says that it drives; empty: the client is of another
/// program, or its program has ended.
std::vector<std::string> joints_driven_by(const std::string& client, const std::string& board);

/// Waits until no other diagram drives one of these joints, up to that time of now(), for the diagram whose
/// ports begin with `prefix`, a Driver there already: of two that begin at once neither finds itself alone.
/// Throws std::runtime_error.
void await_joints(const std::string& robot, const std::vector<std::string>& boards,
                  const std::vector<std::string>& joints, const std::string& prefix, double end);

/// Notices that whoever drives some boards has left.
class Leaving {
  public:
    explicit Leaving(const std::vector<std::string>& boards) : boards_(boards.begin(), boards.end()) {}

    /// To be called a few times a second, with how many commands have come so far. True when the boards are
    /// driven, and nobody is connected any more who can have sent a command since they are: where diagrams
    /// were among those, the diagrams.
    bool look(std::uint64_t commands, bool is_driven);

  private:
    struct Client {
        double first, last; ///< seen, s
        bool is_diagram;
    };
    std::list<Clients> boards_;
    std::map<std::string, Client> lately_;      ///< commands are under way for longer than connections
    std::map<std::string, bool> may_have_sent_; ///< who, and whether it is a diagram
    std::uint64_t commands_ = 0;
};

} // namespace bf::yarp
