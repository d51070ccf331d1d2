//! Element block: elements of one kind and one material with their own copies of their nodes.
