# bf_expected(EXAMPLE): the model gives what its expected.csv says, within a tolerance.
set(tolerance_of_dc_motor 1e-5)
set(tolerance_of_double_pendulum 1e-6)
set(tolerance_of_two_rates 1e-12)
set(tolerance_of_thermostat 1e-12)
set(tolerance_of_cart_pole 1e-7)
set(tolerance_of_stick_slip 1e-5)
set(tolerance_of_buck_converter 1e-6)
set(tolerance_of_bouncing_ball 1e-9)
set(tolerance_of_shared_resource 1e-12)
set(tolerance_of_bouncing_mass 1e-9)
function(bf_expected example)
    add_test(NAME examples.${example}_gives_what_is_expected
        COMMAND ${BF_PYTHON} ${CMAKE_SOURCE_DIR}/examples/compare.py $<TARGET_FILE:bf>
                ${CMAKE_SOURCE_DIR}/examples/${example} ${tolerance_of_${example}})
    set_tests_properties(examples.${example}_gives_what_is_expected PROPERTIES
        ENVIRONMENT "BLOCKFACTORY_PLUGIN_PATH=${BF_PLUGIN_DIRECTORY}")
endfunction()
