// The service by which others step a simulator, of which YARP's compiler makes a client for the tests.
namespace yarp clock_client

service ClockServer {
    oneway void pauseSimulation();
    oneway void continueSimulation();
    oneway void stepSimulation(1: i32 numberOfSteps = 1);
    void stepSimulationAndWait(1: i32 numberOfSteps = 1);
    oneway void resetSimulationTime();
    double getSimulationTime();
    double getStepSize();
}
