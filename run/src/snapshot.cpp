#include "bf/run/snapshot.hpp"

#include "bf/core/hash.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

namespace bf {

namespace {

using Bytes = std::span<const std::byte>;

constexpr std::string_view magic = "bf-snapshot\n";
constexpr std::uint32_t byte_order = 0x01020304, version = 5;

class ByteWriter {
  public:
    template <class T> void put(T value) { put(std::as_bytes(std::span(&value, 1))); }
    void put(Bytes bytes) { content.insert(content.end(), bytes.begin(), bytes.end()); }
    void put_block(Bytes bytes) {
        put(std::uint64_t{bytes.size()});
        put(bytes);
    }
    std::vector<std::byte> content;
};

class ByteReader {
  public:
    ByteReader(Bytes bytes, const std::string& name) : bytes_(bytes), name_(name) {}
    Bytes take(std::uint64_t count) {
        if (count > bytes_.size())
            fail("ends within its content: it was cut; make it again with bf run --snapshot");
        const Bytes taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }
    template <class T> T get() {
        T value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }
    Bytes block() { return take(get<std::uint64_t>()); }
    Bytes rest() const { return bytes_; }
    [[noreturn]] void fail(const std::string& what) const {
        throw RunError("the snapshot '" + name_ + "' " + what);
    }

  private:
    Bytes bytes_;
    const std::string& name_;
};

/// The values that the model, not the run, gives its parameters.
std::vector<std::byte> given_parameters(const Run& run) {
    std::vector<std::byte> all;
    for (const auto& parameter : run.parameters())
        all.insert(all.end(), parameter.given.begin(), parameter.given.end());
    return all;
}

/// Arguments that the model gives its blocks, each part of them with a zero behind it.
std::string given_arguments(const Run& run) {
    std::string all;
    for (const auto& argument : run.arguments())
        for (const auto* part : {&argument.block, &argument.name, &argument.value}) all += *part + '\0';
    return all;
}

std::vector<GivenArgument> arguments_in(std::string_view text) {
    std::vector<GivenArgument> all;
    while (!text.empty()) {
        GivenArgument& argument = all.emplace_back();
        for (auto* part : {&argument.block, &argument.name, &argument.value}) {
            const auto size = std::min(text.find('\0'), text.size());
            *part = text.substr(0, size);
            text.remove_prefix(std::min(size + 1, text.size()));
        }
    }
    return all;
}

/// Which argument one model gives otherwise than the other, as text; empty: none. Those that only one of them
/// gives count where the models have the same blocks.
std::string other_argument(const std::vector<GivenArgument>& then, const std::vector<GivenArgument>& now,
                           bool has_same_blocks) {
    const auto value = [](const auto& among, const GivenArgument& wanted) -> std::string {
        for (const auto& argument : among)
            if (argument.block == wanted.block && argument.name == wanted.name) return argument.value;
        return "";
    };
    for (const auto* list : {&then, &now})
        for (const GivenArgument& argument : *list) {
            const std::string was = value(then, argument), is = value(now, argument);
            if (was == is || (!has_same_blocks && (was.empty() || is.empty()))) continue;
            return "argument '" + argument.name + "' of '" + argument.block + "' was " +
                   (was.empty() ? "not given" : was) + " and is " + (is.empty() ? "not given" : is);
        }
    return "";
}

} // namespace

std::vector<std::byte> make_snapshot(const Run& run) {
    const std::string name = run.name();
    ByteWriter content;
    content.put(run.fingerprint());
    content.put_block(std::as_bytes(std::span(name)));
    content.put(run.steps());
    const std::string arguments = given_arguments(run);
    content.put_block(std::as_bytes(std::span<const char>(arguments)));
    content.put_block(given_parameters(run));
    content.put_block(run.snapshot());

    ByteWriter file;
    file.put(std::as_bytes(std::span(magic)));
    file.put(byte_order);
    file.put(version);
    file.put(fnv1a(content.content));
    file.put_block(content.content);
    return std::move(file.content);
}

void restore_snapshot(Run& run, Bytes snapshot, const std::string& name) {
    ByteReader file(snapshot, name);
    if (snapshot.size() < magic.size() || std::memcmp(snapshot.data(), magic.data(), magic.size()) != 0)
        file.fail("is no snapshot: it does not begin as one; bf run --snapshot writes them");
    file.take(magic.size());
    if (file.get<std::uint32_t>() != byte_order)
        file.fail("was made on a machine with another byte order; make it again on this one");
    if (const auto its = file.get<std::uint32_t>(); its != version)
        file.fail("has version " + std::to_string(its) + ", but this program reads version " +
                  std::to_string(version) + "; make it again with this program");
    const auto checksum = file.get<std::uint64_t>();
    const Bytes all = file.block();
    if (!file.rest().empty() || fnv1a(all) != checksum) file.fail("is damaged: its checksum is wrong");

    const std::string own_name = run.name();
    ByteReader content(all, name);
    const auto its_fingerprint = content.get<std::uint64_t>();
    const Bytes model = content.block();
    const std::string its_name(reinterpret_cast<const char*>(model.data()), model.size());
    if (its_name != own_name)
        content.fail("belongs to the model '" + its_name + "', not to '" + own_name + "'");
    const auto steps = content.get<std::int64_t>(); // for who looks at the file without the model, too
    const Bytes arguments = content.block();
    const bool has_same_blocks = its_fingerprint == run.fingerprint();
    const std::string version = "belongs to another version of '" + own_name + "': ";
    if (const std::string other =
            other_argument(arguments_in({reinterpret_cast<const char*>(arguments.data()), arguments.size()}),
                           run.arguments(), has_same_blocks);
        !other.empty())
        content.fail(version + other + "; only values of parameters may differ");
    if (!has_same_blocks)
        content.fail(version + "step, solver, blocks, sizes, types, rates or connections differ; only values "
                               "of parameters may");
    ByteReader given(content.block(), name);
    const Bytes state = content.block();
    run.restore({state.begin(), state.end()});
    if (steps < 0 || run.steps() != steps)
        content.fail("is damaged: it was taken before step " + std::to_string(run.steps()) +
                     ", but says it was " + std::to_string(steps) + "; make it again with bf run --snapshot");
    for (const auto& parameter : run.parameters()) {
        const Bytes then = given.take(parameter.given.size());
        if (then.empty() || std::memcmp(parameter.given.data(), then.data(), then.size()) == 0) continue;
        std::vector<double> values;
        for (std::size_t i = 0; i < parameter.info.elements(); ++i)
            values.push_back(read_value(parameter.given.data(), parameter.type, static_cast<int>(i)));
        run.set_parameter(parameter.path, values);
    }
}

} // namespace bf
