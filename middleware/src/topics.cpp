#include "bf/middleware/topics.hpp"

#include "bf/base/names.hpp"
#include "bf/core/kept_text.hpp"

#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace bf::middleware {

Topic::Topic(const Arguments& arguments, const MessageTypes& types, bool is_stamp_port)
    : Block(arguments), types_(types) {
    std::vector<std::string> problems;
    check_name(types_.names.topic, "topic", topic, problems);
    try {
        type_ = types_.find(type);
    } catch (const std::runtime_error& error) {
        problems.push_back(std::string("argument 'type': ") + error.what());
    }
    if (type_) wanted_ = fields_of(*type_, fields, "fields", problems);
    if (fields->empty() && !is_stamp_port)
        std::erase_if(wanted_, [](const Field* field) { return field->path == stamp_path; });
    tell(problems);
}

void Topic::tell(std::vector<std::string>& problems) {
    for (auto& text : problems) problem(std::move(text));
}

// ---- publish

Outgoing::Outgoing(const MessageType& type, std::vector<Place> places, int size, const Field* stamp,
                   bool is_model_time)
    : newest(size + 1), message(type.make()), places_(std::move(places)), stamp_(stamp),
      is_model_time_(is_model_time), values_(static_cast<std::size_t>(size) + 1) {}

void Outgoing::send() {
    Stamp stamp;
    if (!newest.read(values_.data(), stamp)) return;
    for (const auto& place : places_)
        place.field->write(message.get(), &values_[static_cast<std::size_t>(place.first)],
                           static_cast<std::size_t>(place.size));
    const double time = is_model_time_ ? values_[0] : clock();
    if (stamp_ != nullptr) stamp_->write(message.get(), &time, 1);
    publish(message.get());
    sent_ = stamp.number;
}

PublishBlock::PublishBlock(const Arguments& arguments, const MessageTypes& types)
    : Topic(arguments, types, false) {
    if (!type_) return;
    inputs_.add(*this, *type_, wanted_);
    stamp_ = *stamp == "none" ? nullptr : type_->field(stamp_path);
    std::vector<std::string> problems;
    texts_ = texts_of(*type_, texts, problems);
    const Field* frame = type_->field(frame_path);
    if (!frame_id->empty() && frame == nullptr)
        problems.push_back(type_->name() + " has no text '" + frame_path + "'; it has " +
                           name_list(paths(*type_, false)));
    else if (!frame_id->empty())
        texts_.emplace_back(frame, std::vector<std::string>{*frame_id});
    tell(problems);
}

void PublishBlock::start(Now at) const {
    const int size = inputs_.size(at);
    auto end = std::make_shared<Outgoing>(*type_, inputs_.places(at, 1), size, stamp_, *stamp == "model");
    for (const auto& [field, its_texts] : texts_) field->write(end->message.get(), its_texts);
    open(at, end);
    at[values].assign(static_cast<std::size_t>(size) + 1, 0.0);
    at[outgoing].end = std::move(end);
}

void PublishBlock::stop(Now at) const noexcept {
    auto& end = at[outgoing].end;
    if (end && end->bell != nullptr) send_last(end);
    end.reset();
}

Status PublishBlock::output(Now at, Out) const noexcept {
    auto& all = at[values];
    Outgoing& end = *at[outgoing].end;
    all[0] = at.time();
    inputs_.copy(at, all.data() + 1);
    end.newest.write(all.data(), now());
    if (end.bell != nullptr) end.bell->ring();
    return ok;
}

// ---- subscribe

Incoming::Incoming(Wanted its_wanted)
    : wanted_(std::move(its_wanted)), frame_(wanted_.type->field("header.frame_id")),
      values_(static_cast<std::size_t>(wanted_.size)) {}

const std::vector<double>* Incoming::read(const void* message) {
    if (frame_ != nullptr && !wanted_.frame.empty() && frame_->text(message) != wanted_.frame) {
        is_of_other_frame = true;
        return nullptr;
    }
    int count = 0;
    if (const int wrong = middleware::read(message, wanted_.places, values_, count); wrong >= 0) {
        too_long_size = count;
        too_long = wrong;
        return nullptr;
    }
    return &values_;
}

void Incoming::refuse(const std::string& text) {
    if (is_refused_) return;
    keep_text(refusal_, text);
    is_refused_ = true;
}

SubscribeBlock::SubscribeBlock(const Arguments& arguments, const MessageTypes& types)
    : Topic(arguments, types, true) {
    if (!type_) return;
    if (!frame_id->empty() && type_->field(frame_path) == nullptr)
        problem("argument 'frame_id': " + type_->name() + " has no header with a frame");
    std::vector<std::string> problems;
    outputs_.add(*this, *type_, wanted_, !fields->empty(), sizes, problems);
    tell(problems);
    if (outputs_.places().empty() && fields->empty())
        problem(type_->name() + " has no numbers of a known size; say by argument 'sizes' how many " +
                name_list(paths(*type_, true)) + " has at most, such as position=7");
}

void SubscribeBlock::start(Now at) const {
    std::fill(at[values].begin(), at[values].end(), 0.0);
    const auto end = open(at, {type_, outputs_.places(), outputs_.size(), frame_id});
    at[incoming].end = end;
    const auto has_come = [&] { return end->has_begun() || !failure(at, *end); };
    if (*start_timeout > 0 && !wait_until(now() + start_timeout, has_come))
        throw std::runtime_error("no message of '" + *topic + "' came within " +
                                 Value(*start_timeout).describe() +
                                 " s; start who sends it, or correct topic, type or reliability");
}

Status SubscribeBlock::output(Now at, Out out) const noexcept {
    Incoming& end = *at[incoming].end;
    if (const Status bad = failure(at, end); !bad) return bad;
    auto& all = at[values];
    const auto [count, its_age] = end.take(at.time(), all.data());
    outputs_.copy(all.data(), out);
    out[age] = its_age;
    out[received] = count;
    if (*timeout > 0 && its_age > *timeout)
        return fail(at,
                    "no message of '%.200s' came within the timeout of %g s; look whether its sender runs, "
                    "or raise timeout",
                    topic->c_str(), *timeout);
    return ok;
}

template <class... Values>
Status SubscribeBlock::fail(Now at, const char* format, Values... values) const noexcept {
    char text[sizeof(StatusText)];
    std::snprintf(text, sizeof text, format, values...);
    keep_text(at[refused].letters, text);
    return Status::failure(at[refused].letters);
}

Status SubscribeBlock::failure(Now at, const Incoming& end) const noexcept {
    if (*end.refusal() != '\0') {
        std::strcpy(at[refused].letters, end.refusal()); // which stays when the end is gone
        return Status::failure(at[refused].letters);
    }
    if (end.is_of_other_frame)
        return fail(at,
                    "a message of '%.120s' is of another frame than '%.80s', which argument 'frame_id' says",
                    topic->c_str(), frame_id->c_str());
    const int place = end.too_long;
    if (place < 0) return ok;
    return outputs_.too_long(place, end.too_long_size);
}

} // namespace bf::middleware
