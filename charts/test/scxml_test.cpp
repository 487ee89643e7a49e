// What W3C, "State Chart XML (SCXML)", 2015, demands, as small charts of our own. The numbers are those of
// the assertions in its implementation report; left out are those of other data models, of invoke, of
// communication with other sessions, of loops, of what an event carries, of errors as events, which here end
// the run, and of documents that are no charts.
#include "machine.hpp"

#include <filesystem>
#include <fstream>
#include <unistd.h>

namespace bf::charts::test {
namespace {

namespace fs = std::filesystem;

Chart chart_of(const std::string& text) {
    const fs::path file =
        fs::path(testing::TempDir()) / ("bf_scxml_test_" + std::to_string(::getpid()) + ".scxml");
    std::ofstream(file) << text;
    return read_scxml(file.string());
}

struct Demand {
    int number;
    const char* claim;
    const char* content;
    int steps = 1;
};

const Demand demands[] = {
    {144, "raised events are taken in their order",
     "<state id='s'><onentry><raise event='a'/><raise event='b'/></onentry>"
     "<transition event='a' target='t'/><transition event='*' target='fail'/></state>"
     "<state id='t'><transition event='b' target='pass'/><transition event='*' target='fail'/></state>"},
    {147, "the first branch whose condition holds is taken",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='s'><onentry><if cond='false'><assign location='x' expr='1'/><elseif cond='x == 0'/>"
     "<assign location='x' expr='x + 2'/><elseif cond='true'/><assign location='x' expr='7'/><else/>"
     "<assign location='x' expr='9'/></if></onentry>"
     "<transition cond='x == 2' target='pass'/><transition target='fail'/></state>"},
    {148, "else where none holds",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='s'><onentry><if cond='false'><assign location='x' expr='1'/><elseif cond='false'/>"
     "<assign location='x' expr='2'/><else/><assign location='x' expr='x + 3'/></if></onentry>"
     "<transition cond='x == 3' target='pass'/><transition target='fail'/></state>"},
    {149, "and nothing where there is no else",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='s'><onentry><if cond='false'><assign location='x' expr='1'/></if></onentry>"
     "<transition cond='x == 0' target='pass'/><transition target='fail'/></state>"},
    {158, "actions run in the order of the document",
     "<state id='s'><onentry><raise event='one'/><raise event='two'/></onentry>"
     "<transition event='two' target='fail'/><transition event='one' target='t'/></state>"
     "<state id='t'><transition event='two' target='pass'/></state>"},
    {175, "a delayed event comes later than others",
     "<state id='s'><onentry><send event='late' delay='300ms'/><send event='soon' delay='0.1s'/></onentry>"
     "<transition event='soon' target='t'/><transition event='late' target='fail'/></state>"
     "<state id='t'><transition event='late' target='pass'/></state>",
     6},
    {189, "what is sent to the chart itself, #_internal, comes before what is sent outside",
     "<state id='s'><onentry><send event='out'/><send event='own' target='#_internal'/></onentry>"
     "<transition event='own' target='pass'/><transition event='out' target='fail'/></state>"},
    {208, "what is cancelled does not come",
     "<state id='s'><onentry><send id='x' event='a' delay='0.1s'/><send event='b' delay='0.3s'/>"
     "<cancel sendid='x'/></onentry><transition event='a' target='fail'/>"
     "<transition event='b' target='pass'/></state>",
     6},
    {279, "data has its value from the start, wherever it is declared",
     "<state id='s'><transition cond='x == 4' target='pass'/><transition target='fail'/></state>"
     "<state id='later'><datamodel><data id='x' expr='4'/></datamodel></state>"},
    {310, "In() tells what is active, in another region, too",
     "<parallel id='p'><state id='r1'><state id='a'><transition cond=\"In('b') &amp;&amp; ~In('c')\" "
     "target='pass'/>"
     "<transition target='fail'/></state></state>"
     "<state id='r2'><state id='b'/><state id='c'/></state></parallel>"},
    {355, "the chart begins in the first state", "<state id='s'><transition target='pass'/></state>"},
    {364, "a state begins as it says, by attribute, element or order",
     "<state id='s' initial='s12'><transition event='bad' target='fail'/>"
     "<state id='s11'><onentry><raise event='bad'/></onentry></state>"
     "<state id='s12'><transition target='t'/></state></state>"
     "<state id='t'><initial><transition target='t2'/></initial>"
     "<state id='t1'><transition target='fail'/></state><state id='t2'><transition "
     "target='u'/></state></state>"
     "<state id='u'><state id='u1'><transition target='pass'/></state>"
     "<state id='u2'><transition target='fail'/></state></state>"},
    {372, "done.state comes behind the entry of the final state",
     "<datamodel><data id='x' expr='1'/></datamodel>"
     "<state id='s' initial='f'><transition event='done.state.s' cond='x == 2' target='pass'/>"
     "<transition event='*' target='fail'/><final id='f'><onentry><assign location='x' expr='2'/></onentry>"
     "<onexit><assign location='x' expr='3'/></onexit></final></state>"},
    {375, "entry actions run in their order",
     "<state id='s'><onentry><raise event='a'/></onentry><onentry><raise event='b'/></onentry>"
     "<transition event='a' target='t'/><transition event='*' target='fail'/></state>"
     "<state id='t'><transition event='b' target='pass'/><transition event='*' target='fail'/></state>"},
    {377, "exit actions run in their order",
     "<state id='s'><onexit><raise event='a'/></onexit><onexit><raise event='b'/></onexit>"
     "<transition target='t'/></state><state id='t'><transition event='a' target='u'/>"
     "<transition event='*' target='fail'/></state><state id='u'><transition event='b' target='pass'/>"
     "<transition event='*' target='fail'/></state>"},
    {387, "a history without memory leads to its default",
     "<state id='s'><transition event='a' target='h'/><onentry><raise event='a'/></onentry></state>"
     "<state id='p' initial='p1'><transition event='good' target='pass'/><transition event='bad' "
     "target='fail'/>"
     "<history id='h' type='shallow'><transition target='p2'/></history>"
     "<state id='p1'><onentry><raise event='bad'/></onentry></state>"
     "<state id='p2' initial='p21'><state id='p21'><onentry><raise event='good'/></onentry></state>"
     "<state id='p22'><onentry><raise event='bad'/></onentry></state></state></state>"},
    {388, "a deep history restores all, a shallow one the children",
     "<datamodel><data id='n' expr='0'/></datamodel>"
     "<state id='p' initial='p1'><onentry><assign location='n' expr='n + 1'/></onentry>"
     "<history id='deep' type='deep'><transition target='p1'/></history>"
     "<history id='shallow' type='shallow'><transition target='p1'/></history>"
     "<state id='p1'><transition target='p22'/></state>"
     "<state id='p2' initial='p21'><state id='p21'><transition cond='n == 3' target='pass'/>"
     "<transition cond='n ~= 3' target='fail'/></state>"
     "<state id='p22'><transition cond='n == 1' target='out'/><transition cond='n == 2' target='out'/>"
     "<transition cond='n == 3' target='fail'/></state></state></state>"
     "<state id='out'><transition cond='n == 1' target='deep'/><transition cond='n == 2' "
     "target='shallow'/></state>"},
    {396, "an event is matched by its name",
     "<state id='s'><onentry><raise event='foo'/></onentry><transition event='bar' target='fail'/>"
     "<transition event='foo' target='pass'/></state>"},
    {399, "descriptors match prefixes, lists and everything, but no parts of words",
     "<state id='s'><onentry><raise event='foo.zoo'/><raise event='bar'/><raise event='foos'/><raise "
     "event='x.y.z'/>"
     "</onentry><transition event='food foo' target='t'/></state>"
     "<state id='t'><transition event='foo bar' target='u'/></state>"
     "<state id='u'><transition event='foo' target='fail'/><transition event='foos.*' target='v'/></state>"
     "<state id='v'><transition event='x.y.*' target='pass'/><transition event='*' target='fail'/></state>"},
    {403, "inner transitions come before outer ones, earlier before later ones",
     "<state id='s' initial='s1'><onentry><raise event='a'/></onentry><transition event='a' target='fail'/>"
     "<transition event='b' target='pass'/><state id='s1'><transition event='a' target='s2'/>"
     "<transition event='a' target='fail'/></state>"
     "<state id='s2'><onentry><raise event='b'/></onentry><transition event='b' cond='false' target='fail'/>"
     "</state></state>"},
    {4032, "each region answers by itself, and is preempted by one before it",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<parallel id='p'><onentry><raise event='a'/></onentry>"
     "<state id='r1'><state id='r1a'><transition event='a' target='r1x'/></state>"
     "<state id='r1x'><onentry><assign location='x' expr='x + 1'/></onentry></state></state>"
     "<state id='r2'><state id='r2a'><transition event='a' target='r2b'/></state>"
     "<state id='r2b'><onentry><assign location='x' expr='x + 10'/></onentry>"
     "<transition cond='x == 11' target='pass'/></state></state></parallel>"},
    {404, "states are left before their transition acts, the last one first",
     "<state id='s'><transition target='p'/></state>"
     "<parallel id='p'><onexit><raise event='e3'/></onexit><transition target='t'><raise "
     "event='e4'/></transition>"
     "<state id='r1'><onexit><raise event='e2'/></onexit></state>"
     "<state id='r2'><onexit><raise event='e1'/></onexit></state></parallel>"
     "<state id='t'><transition event='e1' target='t2'/><transition event='*' target='fail'/></state>"
     "<state id='t2'><transition event='e2' target='t3'/><transition event='*' target='fail'/></state>"
     "<state id='t3'><transition event='e3' target='t4'/><transition event='*' target='fail'/></state>"
     "<state id='t4'><transition event='e4' target='pass'/><transition event='*' target='fail'/></state>"},
    {405, "transitions of one microstep act in the order of the document",
     "<state id='s'><transition target='p'/></state>"
     "<parallel id='p'><transition event='e1' target='t'/><state id='r1'><state id='a'>"
     "<transition target='a2'><raise event='e1'/></transition></state><state id='a2'/></state>"
     "<state id='r2'><state id='b'><transition target='b2'><raise event='e2'/></transition></state>"
     "<state id='b2'/></state></parallel>"
     "<state id='t'><transition event='e2' target='pass'/><transition event='*' target='fail'/></state>"},
    {406, "states are entered behind the transition, parents first",
     "<state id='s'><transition target='p'><raise event='e1'/></transition></state>"
     "<state id='p'><onentry><raise event='e2'/></onentry><transition event='e1' target='pa'/>"
     "<parallel id='pa'><onentry><raise event='e3'/></onentry><transition event='e2' target='t'/>"
     "<state id='r1'><onentry><raise event='e4'/></onentry></state></parallel></state>"
     "<state id='t'><transition event='e3' target='t2'/><transition event='e4' target='fail'/></state>"
     "<state id='t2'><transition event='e4' target='t3'/></state>"
     "<state id='t3'><transition target='pass'/></state>"},
    {409, "a state that was left is not active while its parent is left",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p' initial='a'><onexit><assign location='x' expr=\"1 + In('a') + 2*In('p')\"/></onexit>"
     "<state id='a'><transition target='t'/></state></state>"
     "<state id='t'><transition cond='x == 3' target='pass'/><transition target='fail'/></state>"},
    {411, "a state is active when its entry actions run, its child is not yet",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p'><onentry><assign location='x' expr=\"In('p') + 2*In('a')\"/></onentry>"
     "<state id='a'><onentry><assign location='x' expr=\"x + 10*In('a')\"/></onentry>"
     "<transition cond='x == 11' target='pass'/><transition target='fail'/></state></state>"},
    {412, "the initial transition acts behind the entry of the state and before that of its child",
     "<datamodel><data id='x' expr='1'/></datamodel>"
     "<state id='p'><onentry><assign location='x' expr='2*x'/></onentry>"
     "<initial><transition target='a'><assign location='x' expr='x + 3'/></transition></initial>"
     "<state id='a'><onentry><assign location='x' expr='10*x'/></onentry>"
     "<transition cond='x == 50' target='pass'/><transition target='fail'/></state></state>"},
    {413, "a chart may begin in states of several regions",
     "<state id='p' initial='b2 c2'><parallel id='q'>"
     "<state id='b'><state id='b1'/><state id='b2'><transition cond=\"In('c2')\" "
     "target='pass'/></state></state>"
     "<state id='c'><state id='c1'><transition target='fail'/></state><state "
     "id='c2'/></state></parallel></state>"},
    {416, "a final child raises done.state",
     "<state id='p'><state id='q' initial='f'><transition event='done.state.q' target='pass'/><final "
     "id='f'/></state>"
     "</state>"},
    {417, "a parallel state is done when all its regions are",
     "<parallel id='p'><onentry><raise event='go'/></onentry><transition event='done.state.p' target='pass'/>"
     "<state id='a' initial='a1'><state id='a1'><transition event='go' target='a2'/></state>"
     "<final id='a2'/></state><state id='b' initial='b2'><final id='b2'/></state></parallel>"},
    {419, "transitions without an event come before events",
     "<state id='s'><onentry><raise event='a'/></onentry><transition event='*' target='fail'/>"
     "<transition target='pass'/></state>"},
    {421, "own events come before those from outside",
     "<state id='s'><onentry><send event='out'/><raise event='a'/><raise event='b'/></onentry>"
     "<transition event='out' target='fail'/><transition event='b' target='t'/></state>"
     "<state id='t'><transition event='out' target='pass'/></state>"},
    {423, "events from outside that enable nothing are dropped, one after the other",
     "<state id='s'><onentry><send event='a'/><send event='b' delay='0.2s'/></onentry>"
     "<transition event='c' target='fail'/><transition event='b' target='pass'/></state>",
     4},
    {503, "a transition without a goal leaves nothing",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='s'><onentry><raise event='a'/><raise event='b'/></onentry>"
     "<onexit><assign location='x' expr='x + 1'/></onexit><transition event='a'/>"
     "<transition event='b' cond='x == 0' target='pass'/><transition event='b' target='fail'/></state>"},
    {504, "an external transition leaves its source and what is inside",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p'><onentry><raise event='a'/></onentry><onexit><assign location='x' expr='x + 1'/></onexit>"
     "<transition event='a' cond='x == 0' target='c'/><transition event='a' cond='x == 11' target='pass'/>"
     "<transition event='a' target='fail'/>"
     "<state id='c'><onexit><assign location='x' expr='x + 10'/></onexit></state></state>"},
    {505, "an internal one does not leave its source",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p'><onentry><raise event='a'/><raise event='b'/></onentry>"
     "<onexit><assign location='x' expr='x + 1'/></onexit>"
     "<transition event='a' type='internal' target='c'/><transition event='b' cond='x == 10' target='pass'/>"
     "<transition event='b' target='fail'/>"
     "<state id='c'><onexit><assign location='x' expr='x + 10'/></onexit></state></state>"},
    {506, "an internal one to the outside is external",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p'><onentry><raise event='a'/></onentry><onexit><assign location='x' expr='x + 1'/></onexit>"
     "<transition event='a' cond='x == 0' type='internal' target='p'/>"
     "<transition event='a' cond='x == 1' target='pass'/><state id='c'/></state>"},
    {533, "an internal one of a parallel state is external",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<parallel id='p'><onentry><raise event='a'/></onentry><onexit><assign location='x' expr='x + "
     "1'/></onexit>"
     "<transition event='a' cond='x == 0' type='internal' target='c1'/>"
     "<transition event='a' cond='x == 1' target='pass'/>"
     "<state id='c'><state id='c1'/></state></parallel>"},
    {570, "done.state of regions comes before that of their parallel state",
     "<parallel id='p'><onentry><raise event='e1'/></onentry>"
     "<state id='a' initial='a1'><state id='a1'><transition event='e1' target='a2'/></state><final "
     "id='a2'/></state>"
     "<state id='b' initial='b1'><state id='b1'><transition event='done.state.a' target='b2'/></state>"
     "<final id='b2'/></state><transition event='done.state.p' target='pass'/></parallel>"},
    {576, "a chart may begin deep inside",
     "<state id='s'><transition target='fail'/></state>"
     "<state id='p'><state id='q'><state id='r'/><state id='begin'><transition "
     "target='pass'/></state></state></state>"},
    {579, "the default of a history acts, and only the first time",
     "<datamodel><data id='x' expr='0'/></datamodel>"
     "<state id='p'><history id='h'><transition target='c'><assign location='x' expr='x + "
     "1'/></transition></history>"
     "<initial><transition target='h'><assign location='x' expr='x + 100'/></transition></initial>"
     "<state id='c'><transition target='d'/></state>"
     "<state id='d'><transition cond='x == 101' target='out'/><transition cond='x == 201' target='pass'/>"
     "<transition cond='x &gt; 201' target='fail'/></state></state>"
     "<state id='out'><transition target='p'/></state>"},
};

TEST(Scxml, DoesWhatTheStandardDemands) {
    for (const auto& [number, claim, content, steps] : demands) {
        SCOPED_TRACE(std::to_string(number) + ": " + claim);
        const std::string begin = number == 576 ? " initial='begin'" : "";
        Chart chart;
        try {
            chart =
                chart_of("<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0' datamodel='matlab'" +
                         begin + ">" + content + "<final id='pass'/><final id='fail'/></scxml>");
            Machine machine(lower(chart));
            for (int k = 0; k < steps; ++k) EXPECT_TRUE(machine.step(0.1 * k));
            EXPECT_EQ(machine.names().substr(0, 4), "pass");
        } catch (const Refused& refused) {
            for (const auto& problem : refused.problems()) ADD_FAILURE() << problem;
        }
    }
}

std::string file_refusal(const std::string& text) {
    try {
        lower(chart_of(text));
    } catch (const Refused& refused) {
        std::string all;
        for (const auto& problem : refused.problems())
            all += (all.empty() ? "" : "\n") + problem.substr(problem.find(".scxml") + 6);
        return all;
    }
    return "nothing";
}

TEST(Scxml, EventsThatNobodyRaisesAreInputs) {
    const Chart chart = chart_of("<scxml><state id='a'><transition event='key.up stop' target='b'/>"
                                 "<transition event='error.execution' target='b'/></state>"
                                 "<state id='b'><onentry><raise event='own'/></onentry>"
                                 "<transition event='own' target='a'/></state></scxml>");
    EXPECT_EQ(chart.events, (std::vector<std::string>{"key.up", "stop"}));
    EXPECT_EQ(lower(chart).ports, (std::vector<std::string>{"key_up", "stop"}));
    EXPECT_TRUE(chart.is_completed);
}

TEST(Scxml, ReadsTagsWithMarksOfTagsBetweenQuotes) {
    std::string states;
    for (int i = 0; i < 300; ++i)
        states +=
            "<state id='s" + std::to_string(i) + "'><transition cond=\"time > 1\" target='s0'/></state>";
    EXPECT_EQ(file_refusal("<scxml>" + states + "</scxml>"), "nothing");
}

TEST(Scxml, RefusesWhatItDoesNotRead) {
    EXPECT_EQ(file_refusal("<scxml><state id='a'><invoke/></state></scxml>"),
              ", <invoke> in state 'a': it is not read here");
    EXPECT_EQ(
        file_refusal("<scxml><state id='a'/><onentry/><onexit/><transition event='e' target='a'/></scxml>"),
        ", <onentry>: it is not read here\n, <onexit>: it is not read here\n"
        ", <transition>: it is not read here");
    EXPECT_EQ(file_refusal("<scxml datamodel='ecmascript'><state id='a'/></scxml>"),
              ", <scxml>: its data model is 'ecmascript'; write formulas of this project, and "
              "datamodel=\"matlab\"");
    EXPECT_NE(
        file_refusal("<scxml datamodel='xpath'><state id='a'/></scxml>").find("its data model is 'xpath'"),
        std::string::npos);
    EXPECT_EQ(file_refusal("<scxml binding='late'><state id='a'/></scxml>"),
              ", <scxml>: its data is bound late; assign to it in <onentry>, and leave the binding out");
    EXPECT_EQ(file_refusal(
                  "<scxml><state id='a'><onentry><send event='x' delay='soon'/></onentry></state></scxml>"),
              ", <send> in state 'a': <send> has the delay 'soon'; write seconds, '1.5s', or '20ms'");
    EXPECT_EQ(file_refusal("<scxml><state id='a'><onentry><raise/></onentry><onexit><send id='x'/></onexit>"
                           "</state></scxml>"),
              ", <raise> in state 'a': it has no event; write event=\"NAME\"\n"
              ", <send> in state 'a': it has no event; write event=\"NAME\"");
    EXPECT_EQ(file_refusal("<scxml><state id='a'>"), ":1: the file is no XML: unexpected end of data");
    EXPECT_EQ(file_refusal("<a/>"), ", <a>: the file is no SCXML; it begins with <scxml>");
    std::string deep;
    for (int i = 0; i < 100'000; ++i) deep += "<a>";
    EXPECT_EQ(file_refusal(deep), ": its elements are nested too deeply");
    for (const std::string hides :
         {"<!--></a>-->", "<![CDATA[</a>]]>", "<?a </a>?>", "<?a '?>", "<a'/>", "<b x='</a>'/>"}) {
        std::string hidden; // what parsers do not take for an element's end
        for (int i = 0; i < 100'000; ++i) hidden += "<a>" + hides;
        EXPECT_EQ(file_refusal(hidden), ": its elements are nested too deeply") << hides;
    }
    EXPECT_EQ(file_refusal("<!DOCTYPE a [</a>]><a/>"),
              ": it declares a type of document, which is not read here");
    EXPECT_THROW(read_scxml("/nowhere/chart.scxml"), Refused);
}

TEST(Scxml, RefusesAttributesThatItWouldPassOver) {
    for (const auto& [element, name] :
         {std::pair<std::string, std::string>{"<state id='b' src='x'/>", "src"},
          {"<state id='b'><transition target='a' priority='1'/></state>", "priority"},
          {"<state id='b'><onentry><send event='e' delayexpr='1'/></onentry></state>", "delayexpr"},
          {"<state id='b'><onentry><cancel sendid='e' sendidexpr='1'/></onentry></state>", "sendidexpr"},
          {"<state id='b'><onentry><assign location='x' expr='1' attr='y'/></onentry></state>", "attr"},
          {"<datamodel><data id='y' src='file'/></datamodel>", "src"}})
        EXPECT_NE(file_refusal("<scxml><datamodel><data id='x' expr='0'/></datamodel><state id='a'><onentry>"
                               "<send event='e' id='e'/></onentry></state>" +
                               element + "</scxml>")
                      .find("it has the attribute '" + name + "', which is not read here"),
                  std::string::npos)
            << element;
    EXPECT_EQ(file_refusal("<s:scxml xmlns:s='http://www.w3.org/2005/07/scxml'><s:state id='a' "
                           "xmlns='http://www.w3.org/2005/07/scxml' xml:lang='en'/></s:scxml>"),
              "nothing")
        << "namespaces are no attributes of the chart";
}

TEST(Scxml, DataBeginsWithItsNumberOrItsFormulaOrZero) {
    const Chart chart =
        chart_of("<scxml><datamodel><data id='n' expr='3'/><data id='none'/><data id='f' expr='n + 1'/>"
                 "</datamodel><state id='a'/></scxml>");
    using Variables = std::vector<std::pair<std::string, double>>;
    EXPECT_EQ(chart.variables, (Variables{{"n", 3}, {"none", 0}, {"f", 0}}));
    Machine machine(lower(chart));
    EXPECT_TRUE(machine.step(0));
    EXPECT_EQ(machine.values, (Numbers{3, 0, 4}));
}

TEST(Scxml, MakesNamesOfIdsAndOfStatesWithout) {
    const Chart chart = chart_of(
        "<scxml initial='on-top.now'><state><transition target='on-top.now'/></state><state id='on-top.now'/>"
        "<state/></scxml>");
    EXPECT_EQ(state_paths(chart), (std::vector<std::string>{"state1", "on_top_now", "state2"}));
    EXPECT_EQ(chart.root.initial, std::vector<std::string>{"on_top_now"});
    EXPECT_EQ(arcs(chart).at(0).to, std::vector<std::string>{"on_top_now"});
}

TEST(Scxml, BranchesStandInBranchesUpToTheDepthOfADocument) {
    const auto nested = [](int count) {
        std::string begin, end;
        for (int i = 0; i < count; ++i) begin += "<if cond='true'>", end += "</if>";
        return "<scxml><state id='a'><onentry>" + begin + "<raise event='e'/>" + end +
               "</onentry></state></scxml>";
    };
    EXPECT_EQ(file_refusal(nested(90)), "nothing");
    EXPECT_EQ(file_refusal(nested(110)), ", <if> in state 'a': its elements are nested too deeply");
}

TEST(Scxml, SendsToItselfAloneAndCancelsWhatItSends) {
    EXPECT_EQ(file_refusal("<scxml><state id='a'><onentry><send event='x' "
                           "target='http://other'/></onentry></state></scxml>"),
              ", <send> in state 'a': <send> has the target 'http://other'; charts send to themselves");
    EXPECT_EQ(file_refusal("<scxml><state id='a'><onentry><cancel sendid='x'/></onentry></state></scxml>"),
              ", <cancel> in state 'a': <cancel> names no id of a <send>");
    EXPECT_EQ(
        file_refusal("<scxml><state id='a'><onentry><send event='x' delay='-1s'/></onentry></state></scxml>"),
        ", <send> in state 'a': <send> has the delay '-1s'; write seconds, '1.5s', or '20ms'");
    const Chart chart = chart_of("<scxml><state id='a'><onentry><log label='x'/><send event='x' "
                                 "delay='20ms'/><send event='y' delay='1.5s'/>"
                                 "<send event='z'/></onentry></state></scxml>");
    EXPECT_EQ(chart.root.states.at(0).entry, "send x after 0.02\nsend y after 1.5\nsend z after 0\n");
}

} // namespace
} // namespace bf::charts::test
