"""Whether what comes in and what is made of it is as it should be: counted per message, judged once a second, without ROS."""
