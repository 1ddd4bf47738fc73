/** The profile of the rig as a form, checked as typed. */
export function ProfileForm() {
  return <section class="profile-form" />;
}
