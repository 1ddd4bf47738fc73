// The views of the rig and of a scan, loaded when there is a rig: `epirig view` does without them.

export { RigView } from './rig/RigView';
export { ScanView } from './scan/ScanView';
