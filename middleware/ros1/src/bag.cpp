// Bags, whose messages are played to the blocks that subscribe.
#include "bf/recording/bag.hpp"

#include "bf/base/names.hpp"
#include "bf/base/open_file.hpp"
#include "connection.hpp"
#include "frames.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <stdexcept>

namespace bf::ros1 {

namespace {

using middleware::Incoming;
using recording::BagConnection;

/// All messages of a topic, of which a step takes the newest at its time.
class Played final : public Incoming {
  public:
    using Incoming::Incoming;

    /// What is wrong with a message, or nothing.
    std::string add(std::int64_t time_ns, const void* message) {
        const auto* values = read(message);
        if (is_of_other_frame)
            return "is of another frame than '" + wanted().frame + "', which argument 'frame_id' says";
        if (values == nullptr)
            return "has " + std::to_string(too_long_size) + " elements in '" +
                   wanted().places[static_cast<std::size_t>(too_long)].field->path + "', but at most " +
                   std::to_string(wanted().places[static_cast<std::size_t>(too_long)].size) +
                   " are expected; raise argument 'sizes'";
        times_.push_back(time_ns);
        rows_.insert(rows_.end(), values->begin(), values->end());
        return "";
    }
    std::size_t bytes() const { return rows_.size() * sizeof(double); }
    bool is_empty() const { return times_.empty(); }

    /// In the order of their times, of which the bag begins at that one. Those of one moment stay as they
    /// are.
    void sort(std::int64_t begin) {
        begin_ = begin;
        order_.resize(times_.size());
        std::iota(order_.begin(), order_.end(), std::size_t{0});
        std::ranges::stable_sort(order_, {}, [&](std::size_t i) { return times_[i]; });
        std::ranges::sort(times_);
    }

    News take(double time, double* values) noexcept override {
        const auto now = begin_ + static_cast<std::int64_t>(time * 1e9 + 0.5);
        const auto count = std::upper_bound(times_.begin(), times_.end(), now) - times_.begin();
        if (count == 0) return {0, time};
        const auto row = static_cast<std::size_t>(count) - 1;
        const auto size = static_cast<std::size_t>(wanted().size);
        std::copy_n(rows_.begin() + static_cast<std::ptrdiff_t>(order_[row] * size), size, values);
        return {static_cast<double>(count), static_cast<double>(now - times_[row]) / 1e9};
    }

  private:
    std::int64_t begin_ = 0;          ///< ns
    std::vector<std::int64_t> times_; ///< ns
    std::vector<std::size_t> order_;  ///< number of the row of each time
    std::vector<double> rows_;
};

/// All that a transform was while the bag was recorded, of which a step takes what it was at its time.
class PlayedTransform final : public middleware::TransformView {
  public:
    /// Messages in the order of their times, s since 1970, of which the bag begins at that one.
    PlayedTransform(const std::string& target, const std::string& source, double begin,
                    const std::vector<std::pair<double, middleware::FrameMessage>>& messages)
        : begin_(begin) {
        middleware::FrameBuffer frames;
        middleware::TransformWatch watch(target, source);
        add(begin, watch.look(frames, begin, begin));
        rows_.front().time = -std::numeric_limits<double>::infinity();
        for (const auto& [time, message] : messages) {
            if (const auto wrong = frames.add(message, time); !wrong.empty()) watch.leave_out(wrong);
            add(time, watch.look(frames, time, time));
        }
    }
    void take(double time, double* values) noexcept override { std::ranges::copy(row(time).values, values); }
    void why(double time, std::span<char> text) const noexcept override {
        const std::string& its = row(time).why;
        const auto end = std::copy_n(its.begin(), std::min(its.size(), text.size() - 1), text.begin());
        *end = '\0';
    }
    double now(double time) const noexcept override { return begin_ + time; }
    double looked(double time) const noexcept override { return time; }

  private:
    struct Row {
        double time = 0;
        std::array<double, size> values = {};
        std::string why = "";
    };
    void add(double time, const middleware::KnownTransform& known) {
        Row row{.time = time, .why = known.why};
        write(known, row.values.data());
        if (rows_.empty() || row.values != rows_.back().values || row.why != rows_.back().why)
            rows_.push_back(std::move(row));
    }
    const Row& row(double time) const noexcept {
        return *(std::ranges::upper_bound(rows_, now(time), {}, &Row::time) - 1);
    }
    const double begin_; ///< s since 1970
    std::vector<Row> rows_;
};

/// Some programs leave out the slash with which a name begins.
std::string rooted(const std::string& topic) { return topic.starts_with('/') ? topic : "/" + topic; }

/// A bag that stands for a node.
class Bag final : public Connection {
  public:
    Bag(std::filesystem::path path, double begin) : path_(std::move(path)), begin_(begin) {}

    /// Looks through it, so that all that is wrong with it is told at once.
    void open() override {
        if (first_) return;
        topics_.clear();
        std::optional<std::int64_t> first;
        read({.connection = [&](std::uint32_t,
                                const BagConnection& its) { topics_[rooted(its.topic)] = its.type; },
              .message = [&](std::uint32_t, std::int64_t time,
                             std::span<const std::byte>) { first = std::min(first.value_or(time), time); },
              .defect = {}});
        if (!first) throw std::runtime_error("the bag '" + path_.string() + "' has no messages");
        first_ = *first;
    }
    void close() noexcept override { first_.reset(); }
    bool can_save() const override { return true; }

    void publish(const TopicOptions&, const std::shared_ptr<middleware::Outgoing>&) override {}
    void publish(const TopicOptions&, const std::string&, const std::vector<std::string>&,
                 const std::shared_ptr<middleware::OutgoingTransforms>&) override {}

    std::shared_ptr<void> call(const std::string& service, const ServiceType&,
                               const std::shared_ptr<middleware::Calling>&) override {
        throw std::runtime_error("the bag '" + path_.string() + "' answers no calls of '" + service +
                                 "'; give the block a Node");
    }

    std::shared_ptr<Incoming> subscribe(const TopicOptions& topic, middleware::Wanted wanted) override {
        constexpr std::size_t most_bytes = std::size_t{2} << 30;
        const std::string name = rooted(topic.name);
        const auto fail = [&](const std::string& what) -> void {
            throw std::runtime_error("the bag '" + path_.string() + "': " + what);
        };
        if (!topics_.contains(name)) {
            std::vector<std::string> names;
            for (const auto& [its, type] : topics_) names.push_back(its + " (" + type + ")");
            fail("it has no topic '" + name + "'; it has " + name_list(names));
        }
        auto end = std::make_shared<Played>(std::move(wanted));
        const auto message = std::static_pointer_cast<Message>(topic.type->make());
        std::map<std::uint32_t, bool> is_wanted;
        read({.connection =
                  [&](std::uint32_t number, const BagConnection& its) {
                      is_wanted[number] = rooted(its.topic) == name;
                      if (is_wanted[number] && its.md5 != topic.type->md5())
                          fail("'" + name + "' is of " + its.type + " (" + its.md5 + "), not " +
                               topic.type->name() + " (" + topic.type->md5() +
                               "); correct argument 'type', or install the messages that were recorded");
                  },
              .message =
                  [&](std::uint32_t number, std::int64_t time, std::span<const std::byte> bytes) {
                      if (!is_wanted[number]) return;
                      std::string wrong;
                      try {
                          topic.type->decode(
                              {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, *message);
                          wrong = end->add(time, message.get());
                      } catch (const std::runtime_error& error) {
                          wrong = "is no " + topic.type->name() + ": " + error.what();
                      }
                      if (!wrong.empty())
                          fail("the message of '" + name + "' at " +
                               Value(static_cast<double>(time - *first_) / 1e9).describe() + " s " + wrong);
                      if (end->bytes() > most_bytes)
                          fail("'" + name + "' has more than " + std::to_string(most_bytes >> 30) +
                               " GiB of numbers; name fewer 'fields'");
                  },
              .defect = {}});
        end->sort(*first_ + static_cast<std::int64_t>(begin_ * 1e9 + 0.5));
        return end;
    }

    std::shared_ptr<middleware::TransformView> watch(const std::string& target,
                                                     const std::string& source) override {
        const auto type = transforms_type();
        const auto message = std::static_pointer_cast<Message>(type->make());
        std::map<std::uint32_t, bool> is_static; ///< of the topics of tf
        std::vector<std::pair<double, middleware::FrameMessage>> all;
        read({.connection =
                  [&](std::uint32_t number, const BagConnection& its) {
                      const std::string name = rooted(its.topic);
                      if ((name == "/tf" || name == "/tf_static") && its.md5 == type->md5())
                          is_static[number] = name == "/tf_static";
                  },
              .message =
                  [&](std::uint32_t number, std::int64_t time, std::span<const std::byte> bytes) {
                      const auto found = is_static.find(number);
                      if (found == is_static.end()) return;
                      type->decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                                   *message);
                      for (auto& each : frames_of(*message, found->second))
                          all.emplace_back(static_cast<double>(time) / 1e9, std::move(each));
                  },
              .defect = {}});
        std::ranges::stable_sort(all, {}, [](const auto& each) { return each.first; });
        return std::make_shared<PlayedTransform>(target, source, static_cast<double>(*first_) / 1e9 + begin_,
                                                 all);
    }

  private:
    void read(recording::BagVisit visit) const {
        visit.defect = [&](std::string defect) {
            throw std::runtime_error("the bag '" + path_.string() + "': " + defect);
        };
        std::string wrong = why_unreadable(path_.string());
        std::ifstream file;
        if (wrong.empty()) file.open(path_, std::ios::binary);
        if (wrong.empty() && !file) wrong = file_error(errno);
        if (!wrong.empty())
            throw std::runtime_error("cannot open the bag '" + path_.string() + "': " + wrong);
        // Each chunk goes before the next is decompressed, so a bag may be larger than the memory.
        recording::read_bag(file, path_.string(), visit, {.most_bytes = std::uint64_t{1} << 44});
    }

    const std::filesystem::path path_;
    const double begin_;
    std::optional<std::int64_t> first_;         ///< when the first message was recorded, ns
    std::map<std::string, std::string> topics_; ///< with their types
};

class BagBlock final : public Block {
  public:
    explicit BagBlock(const Arguments& arguments) : Block(arguments) {
        if (file->empty()) problem("argument 'file' is empty; name a bag, such as drive.bag");
    }
    Argument<std::string> file{this, "file", {.initial = "", .doc = "the bag, of format 2.0"}};
    Argument<double> begin{
        this,
        "begin",
        {.initial = 0, .minimum = 0, .maximum = 1e9, .doc = "what is left out of it at its begin, s"}};
    Provides<RosConnection> node{
        this, [this]() -> std::shared_ptr<const RosConnection> {
            return std::make_shared<RosConnection>(RosConnection{
                [path = path_of(*file), s = double(begin)] { return std::make_shared<Bag>(path, s); }});
        }};

    void start(Now at) const override { at[node].open(); }
    void stop(Now at) const noexcept override { at[node].close(); }
};

} // namespace

void add_bag(Library& library) {
    library.group("topics").add<BagBlock>(
        "Bag",
        "A bag of ROS 1 in place of a Node: plays what was recorded to the blocks Subscribe in its subsystem "
        "and below. At time t of the model their newest message is the last one that was recorded until "
        "begin + t s after the first message of the bag, of whatever topic; that is the same bit for bit in "
        "each run. Publish sends nothing there. The start reads the bag, chunks compressed with lz4 and "
        "bz2, too; all numbers that are outputs of a block are kept in memory. It has no ports. Errors: no "
        "bag of format 2.0, or one that was cut or not closed; a topic that it does not have, or with "
        "another type; messages that Subscribe would refuse.");
}

} // namespace bf::ros1
