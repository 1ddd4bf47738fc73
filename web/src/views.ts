// The views of the rig, of a scan and of all sequences, loaded when there is a rig: `epirig view` does without them.

export { RigView } from './rig/RigView';
export { ScanView } from './scan/ScanView';
export { SequencesView } from './sequences/SequencesView';
