#include "bf/dynamics/estimation.hpp"

#include "robots.hpp"

#include <iDynTree/EigenHelpers.h>
#include <iDynTree/ExtWrenchesAndJointTorquesEstimator.h>
#include <iDynTree/SixAxisForceTorqueSensor.h>

#include <gtest/gtest.h>

namespace bf::dynamics::test {
namespace {

constexpr auto force_torque = iDynTree::SIX_AXIS_FORCE_TORQUE;

Eigen::Vector3d read(const iDynTree::Vector3& v) { return iDynTree::toEigen(v); }
iDynTree::Vector3 write(const Eigen::Vector3d& v) {
    iDynTree::Vector3 to;
    iDynTree::toEigen(to) = v;
    return to;
}
iDynTree::VectorDynSize write_all(const Eigen::VectorXd& v) {
    iDynTree::VectorDynSize to(static_cast<std::size_t>(v.size()));
    iDynTree::toEigen(to) = v;
    return to;
}

} // namespace

TEST(ContactWrenches, AreThoseOfIDynTree) {
    iDynTree::ExtWrenchesAndJointTorquesEstimator theirs;
    ASSERT_TRUE(theirs.loadModelAndSensorsFromFileWithSpecifiedDOFs(icub, icub_joints));
    const iDynTree::Model& their_model = theirs.model();
    const auto count = their_model.sensors().getNrOfSensors(force_torque);
    ASSERT_EQ(count, 6u);
    const std::vector<std::string> contacts = {"chest",       "l_sole", "r_sole", "l_lower_leg",
                                               "r_lower_leg", "l_hand", "r_hand"};
    std::vector<std::string> sensors;
    for (std::size_t i = 0; i < count; ++i)
        sensors.push_back(dynamic_cast<const iDynTree::SixAxisForceTorqueSensor&>(
                              *their_model.sensors().getSensor(force_torque, static_cast<std::ptrdiff_t>(i)))
                              .getParentJoint());

    const Model model = Model::load(icub, icub_joints);
    Data data(model);
    ContactWrenches ours(model, icub, sensors, contacts);
    std::mt19937 random(1);
    for (int k = 0; k < 3; ++k) {
        const State state = random_state(model.joints(), random);
        const Eigen::VectorXd nu_dot = random_vector(model.velocities(), random);
        Matrix6X measured(6, static_cast<Eigen::Index>(count)), wrenches(6, 7);
        iDynTree::SensorsMeasurements readings(their_model.sensors());
        for (std::size_t i = 0; i < count; ++i) {
            const Vector6 f = 20.0 * random_vector(6, random);
            measured.col(static_cast<Eigen::Index>(i)) = f;
            iDynTree::Wrench wrench;
            for (unsigned e = 0; e < 6; ++e) wrench(e) = f[e];
            ASSERT_TRUE(readings.setMeasurement(force_torque, static_cast<std::ptrdiff_t>(i), wrench));
        }
        const Eigen::Matrix3d R = state.w_H_b.topLeftCorner<3, 3>();
        ASSERT_TRUE(theirs.updateKinematicsFromFloatingBase(
            write_all(state.s), write_all(state.s_dot), write_all(nu_dot.tail(model.joints())),
            their_model.getFrameIndex("root_link"),
            write(R.transpose() * (nu_dot.head<3>() - model.gravity())),
            write(R.transpose() * state.nu_base.tail<3>()), write(R.transpose() * nu_dot.segment<3>(3))));
        iDynTree::LinkUnknownWrenchContacts unknowns(their_model);
        for (const std::string& contact : contacts)
            ASSERT_TRUE(unknowns.addNewUnknownFullWrenchInFrameOrigin(their_model,
                                                                      their_model.getFrameIndex(contact)));
        iDynTree::LinkContactWrenches found(their_model);
        iDynTree::JointDOFsDoubleArray torques(their_model);
        ASSERT_TRUE(theirs.estimateExtWrenchesAndJointTorques(unknowns, readings, found, torques));

        Eigen::VectorXd tau(model.joints());
        set(model, data, state);
        ours.find(model, data, state.s, state.s_dot, nu_dot, measured, wrenches, tau);
        EXPECT_LT((tau - iDynTree::toEigen(torques)).norm(), 1e-6);
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            // Theirs is in the axes of the link that carries the frame, at the frame's origin.
            const auto link = their_model.getFrameLink(their_model.getFrameIndex(contacts[i]));
            Eigen::Matrix4d H;
            forward_kinematics(model, data, model.frame(their_model.getLinkName(link)), H);
            const auto& wrench = found.contactWrench(link, 0).contactWrench();
            Vector6 expected;
            expected << H.topLeftCorner<3, 3>() * read(wrench.getLinearVec3()),
                H.topLeftCorner<3, 3>() * read(wrench.getAngularVec3());
            EXPECT_LT((wrenches.col(static_cast<Eigen::Index>(i)) - expected).norm(), 1e-6) << contacts[i];
        }
    }
}

} // namespace bf::dynamics::test
