# The Python that draws plots and runs the scripted tests: the one that the set-up provides (cmake/deps.txt:
# Debian's, which has matplotlib), and not whichever python3 comes first in PATH, which may be a version
# manager's that has nothing installed. -DPython3_EXECUTABLE=... names another.
if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python3 COMPONENTS Interpreter)
set(DEFORM_PYTHON python3)
if(Python3_EXECUTABLE)
  set(DEFORM_PYTHON ${Python3_EXECUTABLE})
endif()
