#include "bf/middleware/calls.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace bf::middleware {

Calling::Calling(const ServiceParts& type, std::vector<Place> places, int size,
                 std::vector<Place> answer_places, int answer_size)
    : asked(size), answers(answer_size), request(type.request->make()), places_(std::move(places)),
      answer_places_(std::move(answer_places)), values_(static_cast<std::size_t>(size)),
      answer_(static_cast<std::size_t>(answer_size)) {}

void Calling::send() {
    Stamp stamp;
    if (!asked.read(values_.data(), stamp)) return;
    for (const auto& place : places_)
        place.field->write(request.get(), &values_[static_cast<std::size_t>(place.first)],
                           static_cast<std::size_t>(place.size));
    ++calls; // also one that does not get through stays without an answer
    call(request.get());
    sent = stamp.number;
}

void Calling::take(const void* response) {
    int count = 0;
    if (const int wrong = read(response, answer_places_, answer_, count); wrong >= 0) {
        too_long_size = count;
        too_long = wrong;
        return;
    }
    answers.write(answer_.data(), now());
}

CallBlock::CallBlock(const Arguments& arguments, const ServiceTypes& types)
    : Block(arguments), types_(types) {
    std::vector<std::string> problems;
    check_name(types_.names.topic, "service", service, problems);
    try {
        parts_ = types_.find(type);
    } catch (const std::runtime_error& error) {
        problems.push_back(std::string("argument 'type': ") + error.what());
    }
    if (parts_.request) {
        inputs_.add(*this, *parts_.request, fields_of(*parts_.request, fields, "fields", problems));
        texts_ = texts_of(*parts_.request, texts, problems);
        const auto wanted = fields_of(*parts_.response, answer_fields, "answer_fields", problems);
        outputs_.add(*this, *parts_.response, wanted, !answer_fields->empty(), sizes, problems);
    }
    for (auto& text : problems) problem(std::move(text));
}

void CallBlock::start(Now at) const {
    // An exchange has one number at least.
    at[asked].assign(static_cast<std::size_t>(std::max(inputs_.size(at), 1)), 0.0);
    at[answer].assign(static_cast<std::size_t>(std::max(outputs_.size(), 1)), 0.0);
    auto end = std::make_shared<Calling>(parts_, inputs_.places(at, 0), static_cast<int>(at[asked].size()),
                                         outputs_.places(), static_cast<int>(at[answer].size()));
    for (const auto& [field, its_texts] : texts_) field->write(end->request.get(), its_texts);
    open(at, end);
    at[opened].end = std::move(end);
}

Status CallBlock::output(Now at, Out out) const noexcept {
    Calling& end = *at[opened].end;
    const double time = now();
    if (at[call] > 0 && !(at[last] > 0)) {
        inputs_.copy(at, at[asked].data());
        end.asked.write(at[asked].data(), time);
        end.bell->ring();
    }
    if (const int place = end.too_long; place >= 0) return outputs_.too_long(place, end.too_long_size);
    const std::uint64_t before = end.taken.number, sent = end.sent, calls = end.calls, failed = end.failed;
    end.answers.read(at[answer].data(), end.taken);
    outputs_.copy(at[answer].data(), out);
    const bool is_pending = sent != end.asked.newest() || end.taken.number + failed < calls;
    out[pending] = is_pending ? 1 : 0;
    out[answered] = static_cast<double>(end.taken.number);
    // The wait begins with a call, and anew with each answer.
    if (!is_pending || !end.was_pending || end.taken.number != before) end.since = time;
    end.was_pending = is_pending;
    if (*timeout > 0 && time - end.since > *timeout)
        return Status::failure(
            "the service has not answered within argument 'timeout'; look whether it is there, or raise it");
    return ok;
}

Status CallBlock::update(Now at, Next next) const noexcept {
    next[last] = at[call];
    return ok;
}

} // namespace bf::middleware
