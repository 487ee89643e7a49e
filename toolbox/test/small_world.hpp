// A world with a robot, a gripper that an actuator of its MJCF drives, and a ball.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <unistd.h>

namespace bf::toolbox::test {

/// Path of the world's file: robots "arm" and "hand", whose actuator is "grip", object "ball".
inline std::string small_world() {
    static const std::string made = [] {
        const auto folder =
            std::filesystem::temp_directory_path() / ("small_world_" + std::to_string(getpid()));
        std::filesystem::create_directories(folder);
        std::ofstream(folder / "arm.urdf") << R"(<robot name="arm">
  <link name="stand"><inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="bob"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="swing" type="continuous"><axis xyz="0 1 0"/><parent link="stand"/><child link="bob"/></joint></robot>)";
        std::ofstream(folder / "hand.xml")
            << R"(<mujoco><worldbody><body name="palm"><geom size="0.05" mass="1"/>
  <body name="finger" pos="0.1 0 0"><joint name="finger" axis="0 1 0" damping="0.1"/><geom size="0.02" pos="0.1 0 0" mass="0.1"/></body></body></worldbody>
  <tendon><fixed name="pull"><joint joint="finger" coef="1"/></fixed></tendon>
  <actuator><position name="grip" tendon="pull" kp="5"/></actuator></mujoco>)";
        std::ofstream(folder / "world.xml") << R"(<world step="0.001"><floor/>
  <robot name="arm" file="arm.urdf" position="0 0 2" push_links="bob"/>
  <robot name="hand" file="hand.xml" position="1 0 1"/>
  <sphere name="ball" radius="0.1" mass="0.3" position="0 1 1"/></world>)";
        return (folder / "world.xml").string();
    }();
    return made;
}

} // namespace bf::toolbox::test
