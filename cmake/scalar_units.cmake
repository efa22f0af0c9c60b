# Mechanism and formulations compiled for one more scalar: one source per group, with `prologue` before
# it. Some sources share a translation unit for a short build, but all together would take gigabytes.
# Appends the sources to the list `result`.
function(loopbench_add_scalar_units result name prologue)
  set(sources ${${result}})
  foreach(group
    "drives forces joint kinematics mechanism time_function self_stress \
 body_equations tree_dynamics odca sweep"
    "factored_state level* system* dense_reduction lagrange"
    "factors"
    "loop_solver direction_weights singular_values symmetric_eigen partition")
    separate_arguments(patterns UNIX_COMMAND "${group}")
    set(text "${prologue}")
    foreach(pattern ${patterns})
      file(GLOB found RELATIVE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/mechanism/*/${pattern}.cpp
        ${PROJECT_SOURCE_DIR}/odca/${pattern}.cpp ${PROJECT_SOURCE_DIR}/lagrange/${pattern}.cpp
        ${PROJECT_SOURCE_DIR}/reduction/${pattern}.cpp)
      foreach(source ${found})
        string(APPEND text "#include \"${source}\"\n")
      endforeach()
    endforeach()
    list(GET patterns -1 unit)
    string(REPLACE "*" "" unit ${unit})  # ninja loses the dependencies of such a name
    set(unit ${CMAKE_CURRENT_BINARY_DIR}/${unit}_${name}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "${text}" @ONLY)
    list(APPEND sources ${unit})
  endforeach()
  set(${result} ${sources} PARENT_SCOPE)
endfunction()
