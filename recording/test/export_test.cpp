#include "bf/recording/export.hpp"
#include "support.hpp"

#include <cmath>
#include <limits>

namespace bf::recording {
namespace {

Channel signal(const std::string& name, const std::vector<std::int64_t>& time_ns,
               const std::vector<double>& values, std::uint32_t rows = 1) {
    Channel channel{name, "/" + name, {.rows = rows}, time_ns, {}};
    channel.data.resize(values.size() * sizeof(double));
    std::memcpy(channel.data.data(), values.data(), channel.data.size());
    return channel;
}

Recording recording_of(std::vector<Channel> channels) {
    Recording recording;
    recording.channels = std::move(channels);
    return recording;
}

TEST(Csv, WritesOneExactTableWhenTimesAgree) {
    const Folder folder;
    const double inf = std::numeric_limits<double>::infinity();
    Channel tau = signal("arm.tau", {0, 500'000'000}, {0.1, -0.0, 1.0 / 3.0, -inf}, 2);
    tau.info.unit = "N m";
    const Channel s = signal("a,\"b\"", {0, 500'000'000}, {std::nan(""), 1e-300});
    const auto paths = write_csv(recording_of({tau, s}), folder / "run.csv");
    ASSERT_EQ(paths, std::vector{folder / "run.csv"});
    EXPECT_EQ(read_file(paths[0]), "time (s),arm.tau[1] (N m),arm.tau[2] (N m),\"a,\"\"b\"\"\"\n"
                                   "0,0.1,-0,nan\n"
                                   "0.5,0.3333333333333333,-inf,1e-300\n");
}

TEST(Csv, WritesOneFilePerSignalWhenTimesDiffer) {
    const Folder folder;
    const auto paths =
        write_csv(recording_of({signal("a.x", {0, 1}, {1, 2}), signal("y", {0}, {3})}), folder / "run.csv");
    ASSERT_EQ(paths, (std::vector{folder / "run_a.x.csv", folder / "run_y.csv"}));
    EXPECT_EQ(read_file(paths[0]), "time (s),a.x\n0,1\n1e-09,2\n");
    EXPECT_EQ(read_file(paths[1]), "time (s),y\n0,3\n");
    EXPECT_FALSE(std::filesystem::exists(folder / "run.csv"));
}

TEST(Csv, GivesEachSignalAFileWhateverItsName) {
    const Folder folder;
    const std::string endless(300, 'x');
    const auto paths = write_csv(recording_of({signal("a/b", {0}, {1}), signal("a_b", {1}, {2}),
                                               signal("../../x\n", {2}, {3}), signal(endless, {3}, {4})}),
                                 folder / "run.csv");
    ASSERT_EQ(paths,
              (std::vector{folder / "run_a_b.csv", folder / "run_a_b_2.csv", folder / "run_.._.._x_.csv",
                           folder / ("run_" + std::string(120, 'x') + ".csv").c_str()}));
    EXPECT_EQ(read_file(paths[0]), "time (s),a/b\n0,1\n");
    EXPECT_EQ(read_file(paths[1]), "time (s),a_b\n1e-09,2\n");
    EXPECT_EQ(read_file(paths[2]), "time (s),\"../../x\n\"\n2e-09,3\n");
}

TEST(Csv, AppearsWholeOrNotAtAll) {
    const Folder folder;
    std::filesystem::create_directory(folder / "run_y.csv");
    const auto recording = recording_of({signal("x", {0, 1}, {1, 2}), signal("y", {0}, {3})});
    EXPECT_CONTAINS(error_of([&] { write_csv(recording, folder / "run.csv"); }), "Is a directory");
    EXPECT_FALSE(std::filesystem::exists(folder / "run_x.csv"));
}

TEST(Csv, OfNoSignalsIsATableWithoutRows) {
    const Folder folder;
    ASSERT_EQ(write_csv(recording_of({}), folder / "run.csv").size(), 1u);
    EXPECT_EQ(read_file(folder / "run.csv"), "time (s)\n");
}

TEST(Mat, GivesEachSignalOneStructOfAValidName) {
    const Folder folder;
    const std::string endless(70, 'x');
    std::vector<Channel> channels;
    for (const auto& name : {std::string("a.b"), std::string("a_b"), std::string("a b"), std::string("1st"),
                             std::string("_y"), endless + "1", endless + "2"})
        channels.push_back(signal(name, {0}, {1}));
    write_mat(recording_of(channels), folder / "run.mat");
    // Scipy tells the size of the struct array of each variable and the label in it.
    const std::string script = "import scipy.io, sys; m = scipy.io.loadmat(sys.argv[1]); "
                               "print(*(f'{n} {m[n].shape} {m[n][0, 0][\"signals\"].shape} '"
                               "f'{m[n][0, 0][\"signals\"][0, 0][\"label\"][0][:3]}' "
                               "for n in m if n[:2] != '__'), sep='\\n', file=open(sys.argv[2], 'w'))";
    std::ofstream(folder / "names.py") << script;
    const std::string command = std::string(BF_PYTHON) + " " + (folder / "names.py").string() + " " +
                                (folder / "run.mat").string() + " " + (folder / "names.txt").string();
    ASSERT_EQ(std::system(command.c_str()), 0);
    std::string expected;
    for (const auto& [name, label] : {std::pair(std::string("a_b"), "a.b"),
                                      {"a_b_2", "a_b"},
                                      {"a_b_3", "a b"},
                                      {"x1st", "1st"},
                                      {"x_y", "_y"},
                                      {std::string(63, 'x'), "xxx"},
                                      {std::string(61, 'x') + "_2", "xxx"}})
        expected += name + " (1, 1) (1, 1) " + label + "\n";
    EXPECT_EQ(read_file(folder / "names.txt"), expected);
}

TEST(Export, NamesTheFileThatCannotBeWritten) {
    const Recording recording =
        recording_of({signal("x", std::vector<std::int64_t>(5000), std::vector<double>(5000))});
    EXPECT_CONTAINS(error_of([&] { write_csv(recording, "/nowhere/run.csv"); }),
                    "cannot write /nowhere/run.csv");
    EXPECT_CONTAINS(error_of([&] { write_mat(recording, "/nowhere/run.mat"); }),
                    "cannot write '/nowhere/run.mat'");
    EXPECT_CONTAINS(error_of([&] { write_csv(recording, "/dev/full"); }), "cannot write /dev/full");
    EXPECT_CONTAINS(error_of([&] { write_mat(recording, "/dev/full"); }), "cannot write '/dev/full'");
}

TEST(Difference, IsNoneBetweenEqualRecordings) {
    const Recording a = recording_of({signal("x", {0, 1}, {std::nan(""), 2})});
    EXPECT_FALSE(first_difference(a, a));
}

TEST(Difference, NamesTheEarliestSignalAndTime) {
    const std::vector<std::int64_t> t = {0, 250'000'000, 500'000'000};
    const Recording a = recording_of({signal("x", t, {1, 2, 3}), signal("v", t, {0, 0, 4, 4, 5, 5}, 2)});
    Recording b = recording_of({signal("x", t, {1, 2, 9}), signal("v", t, {0, 0, 4, 7, 5, 5}, 2)});
    const auto difference = first_difference(a, b);
    ASSERT_TRUE(difference);
    EXPECT_EQ(difference->channel, "v");
    EXPECT_EQ(difference->time, 0.25);
    EXPECT_EQ(difference->text, "at 0.25 s the signal 'v[2]' is 4, in the other recording 7");
}

TEST(Difference, SeesSignsOfZeroLengthsTimesAndMissingSignals) {
    const auto text = [](const Channel& a, const Channel& b) {
        const auto difference = first_difference(recording_of({a}), recording_of({b}));
        return difference ? difference->text : "none";
    };
    EXPECT_EQ(text(signal("x", {0}, {0.0}), signal("x", {0}, {-0.0})),
              "at 0 s the signal 'x' is 0, in the other recording -0");
    EXPECT_EQ(text(signal("x", {0, 1}, {1, 1}), signal("x", {0}, {1})),
              "the signal 'x' has 2 samples, in the other recording 1");
    EXPECT_EQ(text(signal("x", {0}, {1}), signal("x", {0, 1}, {1, 1})),
              "the signal 'x' has 1 samples, in the other recording 2");
    EXPECT_EQ(text(signal("x", {1'000'000'000}, {1}), signal("x", {2'000'000'000}, {1})),
              "at 1 s the signal 'x' is sampled, in the other recording at 2 s");
    EXPECT_EQ(text(signal("x", {0}, {1}), signal("y", {0}, {1})), "the other recording lacks the signal 'x'");
    const auto shaped = [&](std::uint32_t rows, std::uint32_t cols, bool is_matrix) {
        Channel channel = signal("x", {0}, std::vector<double>(std::size_t{rows} * cols, 1), rows);
        channel.info.cols = cols;
        channel.info.is_matrix = is_matrix;
        return channel;
    };
    Channel single = signal("x", {0}, {1});
    single.info.type = ElementType::Single;
    const std::vector<Channel> unlike{shaped(1, 1, false), shaped(2, 1, false), shaped(2, 1, true),
                                      shaped(1, 2, true),  shaped(2, 2, true),  single};
    for (std::size_t i = 0; i < unlike.size(); ++i)
        for (std::size_t j = 0; j < unlike.size(); ++j)
            EXPECT_EQ(text(unlike[i], unlike[j]),
                      i == j ? "none" : "the signal 'x' has another type or shape")
                << i << ", " << j;
}

TEST(Difference, OfLengthsIsWhereTheShorterOneEnds) {
    // An earlier difference of another signal is named instead.
    const Channel shorter = signal("x", {0, 1'000'000'000}, {1, 1}),
                  longer = signal("x", {0, 1'000'000'000, 2'000'000'000}, {1, 1, 1});
    for (const auto& [a, b] : {std::pair(shorter, longer), {longer, shorter}}) {
        const auto first = [&a = a, &b = b](std::int64_t at) {
            return first_difference(recording_of({a, signal("y", {at}, {1})}),
                                    recording_of({b, signal("y", {at}, {2})}))
                ->channel;
        };
        EXPECT_EQ(first(1'500'000'000), "y");
        EXPECT_EQ(first(2'500'000'000), "x");
    }
}

} // namespace
} // namespace bf::recording
