#include <bf/core/registry.hpp>

#include <algorithm>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace sensors {

using namespace bf;

/// What the data sheet of a sensor array says: y = gain (raw - offset) for each channel, and its names.
struct Calibration {
    static constexpr const char* resource = "calibration"; // what messages call it

    std::string file;
    std::vector<std::string> channels;
    Vector gain, offset;

    /// What every running diagram has of its own: nothing but the way to the description.
    struct Live {
        static constexpr bool is_cache = true; // nothing to save: a snapshot leaves it out
    };
    std::shared_ptr<Live> open() const { return std::make_shared<Live>(); }

    /// Lines of `name gain offset`; throws with file and line.
    static Calibration read(const std::string& file) {
        Calibration c;
        c.file = file;
        std::ifstream stream(file);
        if (!stream) throw std::runtime_error("cannot read the calibration " + file);
        std::vector<double> gains, offsets;
        std::string name;
        for (double gain = 0, offset = 0; stream >> name;) {
            if (!(stream >> gain >> offset))
                throw std::runtime_error(file + ":" + std::to_string(gains.size() + 1) +
                                         ": write a name, a gain and an offset");
            c.channels.push_back(name);
            gains.push_back(gain);
            offsets.push_back(offset);
        }
        c.gain = Eigen::Map<const Vector>(gains.data(), static_cast<Eigen::Index>(gains.size()));
        c.offset = Eigen::Map<const Vector>(offsets.data(), static_cast<Eigen::Index>(offsets.size()));
        return c;
    }
};

/// Offers the calibration of a file to its subsystem and all below. The file is read once, when the model is
/// compiled.
class CalibrationFile final : public Block {
  public:
    using Block::Block;
    Argument<std::string> file{
        this, "file", {.doc = "name, gain and offset of each channel, one channel a line"}};
    Provides<Calibration> calibration{this, [path = path_of(*file)] {
                                          return std::make_shared<const Calibration>(Calibration::read(path));
                                      }};
};

/// y = gain (raw - offset), every channel of the nearest calibration.
class Calibrate final : public Block {
  public:
    using Block::Block;
    Requires<Calibration> calibration{this, "gains and offsets of the channels"};
    // As many as there are channels; recordings and figures call the elements by their names.
    Dim n{this, "n", [this] { return Dim::Names(calibration->channels); }};

    Input<Vector> raw{this, "raw", {.shape = {n}, .doc = "what the sensors count"}};
    Output<Vector> y{this, "y", {.shape = {n}, .unit = any_unit, .doc = "what they measure"}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = calibration->gain.cwiseProduct(at[raw] - calibration->offset);
        return ok;
    }
};

/// One channel by its name.
class Channel final : public Block {
  public:
    using Block::Block;
    Argument<std::string> name{this, "name", {.doc = "name of the channel in the calibration"}};
    Requires<Calibration> calibration{this};
    // A rule may refuse: the text of its exception becomes a located error of the model.
    Dim n{this, "n", [this] { return position(), Dim::Names(calibration->channels); }};
    Scratch<int> index{this, [this] { return position(); }};

    Input<Vector> u{this, "u", {.shape = {n}, .unit = any_unit, .doc = "all channels"}};
    Output<double> y{this, "y", {.unit = any_unit, .doc = "the one named"}};

    Status output(Now at, Out out) const noexcept override {
        out[y] = at[u][at[index]];
        return ok;
    }

  private:
    int position() const {
        const auto& names = calibration->channels;
        const auto found = std::find(names.begin(), names.end(), *name);
        if (found == names.end())
            throw std::runtime_error("there is no channel '" + *name + "' in " + calibration->file);
        return static_cast<int>(found - names.begin());
    }
};

} // namespace sensors

extern "C" void bf_plugin_v1(bf::Library& library) {
    library.group("sensors")
        .add<sensors::CalibrationFile>("CalibrationFile",
                                       "Calibration of a sensor array, for the blocks around it.")
        .add<sensors::Calibrate>("Calibrate", "Counts to measurements: y = gain (raw - offset).")
        .add<sensors::Channel>("Channel", "One channel of the array by its name.");
}
