#include "bf/middleware/frame_listener.hpp"

#include "bf/core/kept_text.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace bf::middleware {

void TransformView::write(const KnownTransform& from, double* values) {
    std::copy_n(from.target_H_source.data(), 16, values + pose);
    values[state] = static_cast<double>(from.state);
    values[was_found] = from.was_found;
    values[is_static] = !from.stamp;
    values[stamp] = from.stamp.value_or(0);
    values[jumps] = from.jumps;
    values[left_out] = from.left_out;
}

const KnownTransform& TransformWatch::look(const FrameBuffer& frames, double stamps, double now) {
    const auto found = frames.find(target_, source_, now);
    const bool was_static = known_.state == FrameBuffer::State::found && !known_.stamp;
    known_.state = found.state;
    known_.jumps = frames.jumps();
    known_.why = found.why + (found.why.empty() || left_out_.empty() ? "" : "; " + left_out_);
    if (found.state == FrameBuffer::State::found) {
        known_.target_H_source.topLeftCorner<3, 3>() = found.pose.q.toRotationMatrix();
        known_.target_H_source.topRightCorner<3, 1>() = found.pose.p;
        known_.was_found = true;
        known_.stamp.reset();
        if (found.stamp) known_.stamp = static_cast<double>(*found.stamp) / 1e9;
    } else if (was_static) {
        known_.stamp = stamps; // it was so until now
    }
    return known_;
}

void TransformWatch::leave_out(const std::string& why) {
    ++known_.left_out;
    left_out_ = why + ", and left out";
}

// ---- live

/// What stands between the thread that receives and the steps.
class FrameListener::Live final : public TransformView {
  public:
    Live(std::string target, std::string source, const std::function<double()>& clock,
         std::shared_ptr<const void> owner)
        : watch(std::move(target), std::move(source)), owner_(std::move(owner)), clock_(clock), newest_(size),
          text_(letters) {}

    void put(const KnownTransform& known, double time) {
        std::vector<double> values(std::max<std::size_t>(size, letters), 0.0);
        if (known.why != written_) {
            written_ = known.why;
            std::copy_n(written_.begin(), std::min<std::size_t>(written_.size(), letters), values.begin());
            text_.write(values.data(), time);
        }
        write(known, values.data());
        newest_.write(values.data(), time);
    }
    void take(double, double* values) noexcept override {
        Stamp its;
        newest_.read(values, its);
    }
    void why(double, std::span<char> text) const noexcept override {
        double its[letters] = {};
        Stamp when;
        text_.read(its, when);
        const std::size_t count = std::min<std::size_t>(letters, text.size() - 1);
        std::transform(its, its + count, text.begin(),
                       [](double letter) { return static_cast<char>(letter); });
        text[count] = '\0';
    }
    double now(double) const noexcept override { return clock_(); }
    double looked(double) const noexcept override { return middleware::now() - begin_; }

    TransformWatch watch;

  private:
    static constexpr int letters = 300;
    const std::shared_ptr<const void> owner_;
    const double begin_ = middleware::now();
    const std::function<double()> clock_;
    ExchangeBuffer newest_;
    ExchangeBuffer text_; ///< its letters as numbers
    std::string written_;
};

void FrameListener::take(std::span<const FrameMessage> messages) {
    const double arrived = middleware::now(), stamps = clock_();
    const std::lock_guard lock(mutex_);
    const auto ends = alive(watches_);
    if (stamps < last_) frames_.jump();
    last_ = stamps;
    for (const auto& message : messages)
        if (const auto wrong = frames_.add(message, arrived); !wrong.empty())
            for (const auto& end : ends) end->watch.leave_out(wrong);
    for (const auto& end : ends) end->put(end->watch.look(frames_, stamps, arrived), arrived);
}

void FrameListener::leave_out(const std::string& why) {
    const double arrived = middleware::now(), stamps = clock_();
    const std::lock_guard lock(mutex_);
    for (const auto& end : alive(watches_)) {
        end->watch.leave_out(why);
        end->put(end->watch.look(frames_, stamps, arrived), arrived);
    }
}

std::shared_ptr<TransformView> FrameListener::watch(const std::string& target, const std::string& source,
                                                    std::shared_ptr<const void> owner) {
    auto end = std::make_shared<Live>(target, source, clock_, std::move(owner));
    const double now = middleware::now();
    const std::lock_guard lock(mutex_);
    end->put(end->watch.look(frames_, clock_(), now), now);
    watches_.push_back(end);
    return end;
}

// ---- block

SubscribeTransformBlock::SubscribeTransformBlock(const Arguments& arguments) : Block(arguments) {
    for (const auto* frame : {&target, &source})
        if ((*frame)->empty() || **frame == std::string("/"))
            problem("the arguments 'target' and 'source' are to name frames, such as world and base");
}

void SubscribeTransformBlock::start(Now at) const {
    auto& row = at[values];
    const KnownTransform none;
    std::fill(row.begin(), row.end(), 0.0);
    std::copy_n(none.target_H_source.data(), 16, row.begin());
    const auto view = open(at);
    at[opened].end = view;
    const auto is_found = [&] {
        view->take(at.time(), row.data());
        return row[TransformView::was_found] != 0;
    };
    if (*start_timeout > 0 && !wait_until(now() + start_timeout, is_found)) {
        auto& text = at[refused].letters;
        view->why(at.time(), text);
        throw std::runtime_error("the pose of '" + *source + "' in '" + *target + "' is not found within " +
                                 Value(*start_timeout).describe() + " s: " + text +
                                 "; start who sends it, or correct the name");
    }
}

Status SubscribeTransformBlock::output(Now at, Out out) const noexcept {
    using View = TransformView;
    TransformView& view = *at[opened].end;
    auto& row = at[values];
    view.take(at.time(), row.data());
    const bool is_found = row[View::state] == static_cast<double>(FrameBuffer::State::found);
    const double its_age = row[View::was_found] == 0   ? view.looked(at.time())
                           : row[View::is_static] != 0 ? 0
                                                       : view.now(at.time()) - row[View::stamp];
    std::copy_n(row.begin(), 16, out[target_H_source].data());
    out[valid] = is_found;
    out[age] = its_age;
    out[state] = row[View::state];
    out[jumps] = row[View::jumps];
    out[left_out] = row[View::left_out];
    if (*timeout > 0 && its_age > *timeout) {
        auto& text = at[refused].letters;
        constexpr std::string_view first = "the transform is older than argument 'timeout': ";
        char reason[sizeof text - first.size()] = "no newer one comes";
        if (!is_found) view.why(at.time(), reason);
        std::copy(first.begin(), first.end(), text);
        char kept[sizeof reason];
        keep_text(kept, reason);
        std::strcpy(text + first.size(), kept);
        return Status::failure(text);
    }
    return ok;
}

} // namespace bf::middleware
