#include "bf/middleware/fields.hpp"

#include "bf/base/names.hpp"
#include "bf/base/numbers.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <map>
#include <optional>
#include <stdexcept>

namespace bf::middleware {

std::string Field::port() const {
    std::string name = path;
    std::replace(name.begin(), name.end(), '.', '_');
    return name;
}

const Field* MessageType::field(const std::string& path) const {
    const auto found =
        std::find_if(fields_.begin(), fields_.end(), [&](const auto& its) { return its->path == path; });
    return found == fields_.end() ? nullptr : found->get();
}

std::string plain(const std::string& name) {
    std::string text;
    for (const char letter : name) text += std::isalnum(static_cast<unsigned char>(letter)) ? letter : '_';
    return text.empty() || std::isdigit(static_cast<unsigned char>(text.front())) ? "s" + text : text;
}

bool is_number(const Field& field) {
    return field.kind != Field::Kind::text && field.kind != Field::Kind::texts;
}

std::vector<std::string> paths(const MessageType& type, bool are_numbers, const std::string& prefix) {
    std::vector<std::string> all;
    for (const auto& field : type.fields())
        if (is_number(*field) == are_numbers && field->path.starts_with(prefix)) all.push_back(field->path);
    return all;
}

std::vector<const Field*> fields_of(const MessageType& type, const std::vector<std::string>& names,
                                    const char* argument, std::vector<std::string>& problems,
                                    const std::string& prefix) {
    std::vector<const Field*> all;
    for (const auto& path : names) {
        const Field* field = type.field(path);
        if (field == nullptr || !is_number(*field) || !path.starts_with(prefix))
            problems.push_back("argument '" + std::string(argument) + "': " + type.name() +
                               " has no numbers '" + path + "'; it has " +
                               name_list(paths(type, true, prefix)));
        else
            all.push_back(field);
    }
    if (names.empty())
        for (const auto& field : type.fields())
            if (is_number(*field) && field->path.starts_with(prefix)) all.push_back(field.get());
    return all;
}

std::vector<std::pair<const Field*, std::vector<std::string>>> texts_of(const MessageType& type,
                                                                        const std::vector<std::string>& given,
                                                                        std::vector<std::string>& problems) {
    std::vector<std::pair<const Field*, std::vector<std::string>>> all;
    for (const auto& text : given) {
        const auto equals = text.find('=');
        if (equals == std::string::npos) {
            problems.push_back("argument 'texts': '" + text + "' is not given as field=text");
            continue;
        }
        const std::string path = text.substr(0, equals);
        const Field* field = type.field(path);
        if (field == nullptr || is_number(*field)) {
            problems.push_back("argument 'texts': " + type.name() + " has no text '" + path + "'; it has " +
                               name_list(paths(type, false)));
            continue;
        }
        std::vector<std::string> parts{""};
        for (const char letter : text.substr(equals + 1))
            if (letter == ',' && field->kind == Field::Kind::texts)
                parts.emplace_back();
            else
                parts.back() += letter;
        all.emplace_back(field, parts);
    }
    return all;
}

// ---- inputs

void FieldInputs::add(Block& block, const MessageType& type, const std::vector<const Field*>& fields) {
    type_ = type.name();
    for (const Field* field : fields) {
        About about{.unit = any_unit};
        Port port{field, {}, {}, {}};
        const auto set = [&](const auto& key) {
            auto& slot = detail::declared_by(block).slots[static_cast<std::size_t>(key.index())];
            slot.doc = type.name() + ": " + field->path;
            slot.optional = field->kind != Field::Kind::sequence;
            port.is_wired = [key](Now at) { return at.is_connected(key); };
        };
        if (field->is_scalar) {
            const Input<double> key(&block, field->port(), about);
            set(key);
            port.data = [key](Now at) { return &at[key]; };
        } else {
            const bool is_any = field->kind == Field::Kind::sequence;
            about.shape = is_any ? Shape(Dim(&block, ("n_" + field->port()).c_str())) : Shape(field->size);
            const Input<Vector> key(&block, field->port(), about);
            set(key);
            port.data = [key](Now at) { return at[key].data(); };
            port.size = [key](Now at) { return static_cast<int>(at[key].size()); };
        }
        ports_.push_back(std::move(port));
    }
}

std::vector<Place> FieldInputs::places(Now at, int first) const {
    std::vector<Place> all;
    for (const auto& port : ports_) {
        if (!port.is_wired(at)) continue;
        const int its = port.count(at);
        if (port.field->kind == Field::Kind::sequence && port.field->size > 0 && its > port.field->size)
            throw std::runtime_error("input '" + port.field->port() + "' has " + std::to_string(its) +
                                     " elements, but " + type_ + " has room for " +
                                     std::to_string(port.field->size) + " in '" + port.field->path + "'");
        all.push_back({port.field, first, its});
        first += its;
    }
    return all;
}

int FieldInputs::size(Now at) const {
    int size = 0;
    for (const auto& port : ports_)
        if (port.is_wired(at)) size += port.count(at);
    return size;
}

void FieldInputs::copy(Now at, double* to) const noexcept {
    for (const auto& port : ports_) {
        if (!port.is_wired(at)) continue;
        const double* from = port.data(at);
        to = std::copy(from, from + port.count(at), to);
    }
}

// ---- outputs

StatusText::StatusText(const std::string& text) {
    std::snprintf(letters, sizeof letters, "%s", text.c_str());
}

namespace {

std::map<std::string, int> read_sizes(const MessageType& type, const std::vector<std::string>& sizes,
                                      std::vector<std::string>& problems) {
    std::map<std::string, int> bounds;
    for (const auto& text : sizes) {
        const auto equals = text.find('=');
        const std::string path = text.substr(0, equals);
        const Field* field = type.field(path);
        const auto size =
            equals == std::string::npos ? std::nullopt : number_of<int>(text.substr(equals + 1));
        if (!size || *size < 1 || *size > 1'000'000)
            problems.push_back("argument 'sizes': '" + text + "' is not given as field=size, with a whole " +
                               "number from 1 to 1000000, such as " + path + "=7");
        else if (field == nullptr || field->kind != Field::Kind::sequence)
            problems.push_back("argument 'sizes': " + type.name() + " has no '" + path +
                               "' of any number of elements; it has " + name_list(paths(type, true)));
        else
            bounds[path] = *size;
    }
    return bounds;
}

} // namespace

void FieldOutputs::add(Block& block, const MessageType& type, const std::vector<const Field*>& fields,
                       bool are_named, const std::vector<std::string>& sizes,
                       std::vector<std::string>& problems) {
    const auto bounds = read_sizes(type, sizes, problems);
    for (const Field* field : fields) {
        Place place{field, size_, field->size};
        if (field->kind == Field::Kind::sequence) {
            const auto bound = bounds.find(field->path);
            if (bound != bounds.end()) place.size = bound->second;
            if (place.size == 0) {
                if (are_named)
                    problems.push_back("argument 'sizes' is to say how many elements '" + field->path +
                                       "' has at most, such as " + field->path + "=7");
                continue; // it cannot be a port
            }
        }
        const auto add_port = [&](const std::string& name, bool is_scalar, int size, const std::string& doc) {
            About about{.unit = any_unit};
            Port port{size, {}};
            int slot = -1;
            if (is_scalar) {
                const Output<double> key(&block, name, about);
                port.data = [key](Out out) { return &out[key]; };
                slot = key.index();
            } else {
                about.shape = {size};
                const Output<Vector> key(&block, name, about);
                port.data = [key](Out out) { return out[key].data(); };
                slot = key.index();
            }
            detail::declared_by(block).slots[static_cast<std::size_t>(slot)].doc = doc;
            ports_.push_back(std::move(port));
            size_ += size;
        };
        add_port(field->port(), field->is_scalar, place.size, type.name() + ": " + field->path);
        if (field->kind == Field::Kind::sequence)
            add_port(field->port() + "_length", true, 1, "how many elements of " + field->path + " came");
        places_.push_back(place);
        too_long_.emplace_back("a message has {} elements in '" + field->path +
                               "', but at most {} are expected; raise argument 'sizes'");
    }
}

void FieldOutputs::copy(const double* from, Out out) const noexcept {
    for (const auto& port : ports_) {
        std::copy(from, from + port.size, port.data(out));
        from += port.size;
    }
}

Status FieldOutputs::too_long(int place, int count) const noexcept {
    const auto at = static_cast<std::size_t>(place);
    return Status::failure(too_long_[at].letters, count, places_[at].size);
}

int read(const void* message, const std::vector<Place>& places, std::vector<double>& values, int& count) {
    std::fill(values.begin(), values.end(), 0.0);
    for (std::size_t i = 0; i < places.size(); ++i) {
        const auto& [field, first, size] = places[i];
        const auto length = field->length(message);
        if (length > static_cast<std::size_t>(size)) {
            count = static_cast<int>(std::min<std::size_t>(length, INT32_MAX));
            return static_cast<int>(i);
        }
        field->read(message, &values[static_cast<std::size_t>(first)], static_cast<std::size_t>(size));
        if (field->kind == Field::Kind::sequence)
            values[static_cast<std::size_t>(first + size)] = static_cast<double>(length);
    }
    return -1;
}

} // namespace bf::middleware
