// The Whole-Body Toolbox: lists its blocks.
#include "bf/boundary/as_legacy_block.hpp"
#include "control/control.hpp"
#include "controllers/controllers.hpp"
#include "estimators/estimators.hpp"
#include "filters/filters.hpp"
#include "qp/qp_block.hpp"
#include "rigid_body/rigid_body.hpp"
#include "robot/robot.hpp"
#include "streams/streams.hpp"
#include "tasks/tasks.hpp"
#include "trajectories/trajectories.hpp"
#include "utilities/utilities.hpp"
#include "walking/walking.hpp"
#include "world/world.hpp"

extern "C" __attribute__((visibility("default"))) void bf_plugin_v1(bf::Library& library) {
    bf::toolbox::add_robot(library);
    bf::toolbox::add_low_level(library);
    bf::toolbox::add_rigid_body(library);
    bf::toolbox::add_inverse_kinematics(library);
    bf::toolbox::add_qp(library);
    bf::toolbox::add_tasks(library);
    bf::toolbox::add_task_solvers(library);
    bf::toolbox::add_optimal_control(library);
    bf::toolbox::add_controllers(library);
    bf::toolbox::add_trajectories(library);
    bf::toolbox::add_estimators(library);
    bf::toolbox::add_walking(library);
    bf::toolbox::add_filters(library);
    bf::toolbox::add_streams(library);
    bf::toolbox::add_utilities(library);
    bf::toolbox::add_world(library);
    bf::toolbox::add_shared_world(library);
    bf::toolbox::add_world_sensors(library);
}

// The same blocks for engines that know only the paper's API.
BF_LEGACY_BLOCKS(DiscreteFilter, MinimumJerkTrajectoryGenerator, QP, QpOases, OSQP, ForwardKinematics,
                 CenterOfMass, Jacobian, DotJNu, MassMatrix, InverseDynamics, ForwardDynamics, GetBiasForces,
                 GetGravityForces, GetCoriolisForces, CoriolisMatrix, MassMatrixDerivative,
                 CentroidalMomentum, CentroidalTotalMomentumMatrix, DotANu, RelativeTransform,
                 RelativeJacobian, InverseKinematics, Configuration, GetMeasurement, GetSensor, GetLimits,
                 SetReferences, GetLowLevelPIDs, SetLowLevelPID, SetMotorParameters, LocalStreams, StreamRead,
                 StreamWrite, NetworkClock, RealTimeSynchronizer, SimulatorSynchronizer, SimulatorClock,
                 Holder, Errors, MatchSignalSizes, DampPinv, TruncPinv, MujocoWorld, CartesianTask,
                 CenterOfMassTask, MomentumTask, PostureTask, RigidContact, ContactLimits, JointLimits,
                 HierarchicalQP, TaskSpaceInverseDynamics, LQR, MPC, JointPID, CartesianPID, JointImpedance,
                 CartesianImpedance, JointTrajectory, CartesianTrajectory, MomentumObserver, ContactWrenches,
                 LegOdometry, ContactEKF, World, WorldRobot, WorldObject, WorldActuator, WorldPush, WorldRays,
                 WorldContact, WorldTactile, FootstepPlanner, DcmPlanner, SwingFoot, DcmController)
