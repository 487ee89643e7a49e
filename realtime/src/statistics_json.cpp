#include "bf/realtime/statistics_json.hpp"

namespace bf::realtime {

namespace {

using OrderedJson = nlohmann::ordered_json;

double us(Nanoseconds t) { return static_cast<double>(t) / 1000; }

OrderedJson json_of(const std::vector<HistogramRow>& rows) {
    OrderedJson list = OrderedJson::array();
    for (const auto& row : rows)
        list.push_back({{"from_us", us(row.from)},
                        {"to_us", us(row.to)},
                        {"count", row.count},
                        {"per_us", row.density()}});
    return list;
}

OrderedJson json_of(const Histogram& h) {
    return {{"p50", us(h.percentile(0.5))},
            {"p99", us(h.percentile(0.99))},
            {"p99_9", us(h.percentile(0.999))},
            {"p99_99", us(h.percentile(0.9999))},
            {"worst", us(h.max())},
            {"rows", json_of(h.rows())}};
}

} // namespace

OrderedJson statistics_json(const Statistics& s) {
    OrderedJson json{{"period_us", us(s.period)},
                     {"steps", std::int64_t{s.steps}},
                     {"wake_up_us", json_of(s.latency)},
                     {"step_us", json_of(s.computation)},
                     {"response_us", json_of(s.response)},
                     {"deviation_us", json_of(s.jitter)},
                     {"deviation_of_the_period", json_of(s.periods.rows())},
                     {"missed", s.missed()}};
    for (std::size_t i = 0; i < s.misses.size(); ++i)
        json["missed_by_cause"][name(static_cast<Cause>(i))] = std::int64_t{s.misses[i]};
    json["skipped"] = std::int64_t{s.skipped};
    json["degraded"] = std::int64_t{s.degraded};
    return json;
}

OrderedJson first_misses_json(const Statistics& s) {
    OrderedJson list = OrderedJson::array();
    for (const auto& miss : s.first_misses)
        list.push_back({{"step", miss.step},
                        {"cause", name(miss.cause)},
                        {"late_us", us(miss.late)},
                        {"wake_up_us", us(miss.latency)},
                        {"step_us", us(miss.computation)}});
    return list;
}

} // namespace bf::realtime
